"""The effect cavity: a closed cavity filled with a liquid or a gas.

A hollow sphere is filled beyond the greatest pressure that it bears, which a given pressure cannot pass: the pressure has its maximum where the
closed form of an incompressible neo-Hookean wall has it. The state under the pressure of the fluid is that under the same pressure given. A gas
keeps p V^n. A filled ball that swings keeps its energy, and a run that goes on from a checkpoint is the same run. All on 1 and 3 ranks. Open
surfaces, elements with nodes at faces, more drawn out than there is, and moduli that rounding would decide are errors.
"""
import itertools

import numpy

from output_common import OUT
from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "
INNER, OUTER = 0.04, 0.05


def shell(file, low=-2):
    """A hollow sphere: a grid of cubes of 4^3 without the inner 2^3, each shell of it drawn onto a sphere; low 0: its upper half."""
    points, cells = {}, []

    def vertex(corner):
        grid = numpy.array(corner, float)
        shell_number = int(abs(grid).max())
        way = numpy.tan(grid / shell_number * numpy.pi / 4)
        return points.setdefault(corner, (len(points), way / numpy.linalg.norm(way) * (INNER, OUTER)[shell_number - 1]))[0]

    for cube in itertools.product(range(-2, 2), repeat=3):
        if all(-1 <= c < 1 for c in cube) or cube[2] < low:
            continue
        for order in itertools.permutations(range(3)):
            corner = list(cube)
            cell = [vertex(tuple(corner))]
            for axis in order:
                corner[axis] += 1
                cell.append(vertex(tuple(corner)))
            cells.append(cell)
    x = [place for _, place in points.values()]
    with open(file, "w") as f:
        f.write(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(x)}\n")
        for k, place in enumerate(x):
            f.write("{} {:.17g} {:.17g} {:.17g}\n".format(k + 1, *place))
        f.write(f"$EndNodes\n$Elements\n{len(cells)}\n")
        for k, cell in enumerate(cells):
            a, b, c, d = cell
            if numpy.linalg.det([x[b] - x[a], x[c] - x[a], x[d] - x[a]]) < 0:
                c, d = d, c
            f.write(f"{k + 1} 4 2 1 1 {a + 1} {b + 1} {c + 1} {d + 1}\n")
        f.write("$EndElements\n")
    return str(file), sum(abs(numpy.linalg.det([x[k] - x[cell[0]] for k in cell[1:]])) / 6 for cell in cells)


MESH, WALL = shell(OUT / "shell.msh")


def ball(element, law):
    return (f"-bodies s -body_s_mesh {MESH} -body_s_material {law} -body_s_element {element} -body_s_young 1e5 -body_s_poisson 0.49 -body_s_density 1000 "
            "-effect_air_on inside -set_inside_at sphere:0,0,0,0.0405 ")


def scene(effects, element="p2", law="neohookean"):
    return (ball(element, law) + "-sets inside,px,py,pz -set_px_at plane:1,0,0,0 -set_py_at plane:0,1,0,0 -set_pz_at plane:0,0,1,0 "
            "-effect_x_type fixed -effect_x_on px -effect_x_components x -effect_y_type fixed -effect_y_on py -effect_y_components y "
            f"-effect_z_type fixed -effect_z_on pz -effect_z_components z -effects x,y,z,{effects} ")


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def last(folder):
    return {name: values[-1] for name, values in history(folder).items()}


# through the limit point; the closed form has the pressure 2 mu (f(b) - f(a)), f = 1/l + 1/(4 l^4), at the stretches a inside and b outside
run("limit", scene("air") + "-effect_air_type cavity -effect_air_added 1.2e-3 -time static -static_steps 12", 1)
limit = history("limit")
p, rest = limit["air_pressure"], limit["air_volume"][0]
inside = numpy.cbrt(limit["air_volume"] / rest)
outside = numpy.cbrt(1 + (inside**3 - 1) * rest / (rest + WALL))
exact = 2 * 1e5 / 2.98 * (1 / outside + 0.25 / outside**4 - 1 / inside - 0.25 / inside**4)
check(0 < p.argmax() < len(p) - 1 and abs(int(p.argmax()) - int(exact.argmax())) <= 1, f"greatest pressure in row {p.argmax()}, in closed form in {exact.argmax()}")
near(p.max() / exact.max(), 1, 0.05, "greatest pressure over that of the closed form with these volumes")
near(abs(limit["air_volume"] * (1 + p / 2.2e9) - rest - limit["time"] * 1.2e-3).max() / rest, 0, 1e-9, "volume that the water should have, over that at rest")
check(limit["newton"].max() <= 25, f"{limit['newton'].max()} iterations in a load step")

for ranks in (1, 3):
    for element in ("p1", "p2"):
        what = f"{element}, {ranks} ranks"

        # the same pressure, given
        run("filled", scene("air", element) + "-effect_air_type cavity -effect_air_added 5e-5 -time static -static_steps 2 -snes_rtol 1e-12", ranks)
        filled = last("filled")
        run("given", scene("air", element) + f"-effect_air_type pressure -effect_air_value {filled['air_pressure']:.15g} -time static -static_steps 2", ranks)
        near(last("given")["air_volume"] / filled["air_volume"], 1, 1e-6, f"{what}: volume under the same pressure")
        near(last("given")["strain"] / filled["strain"], 1, 1e-6, f"{what}: strain energy")

        # a gas that is pumped in
        run("gas", scene("air", element) + "-effect_air_type cavity -effect_air_added 5e-5 -effect_air_modulus 101325 -effect_air_exponent 1.4 -time static", ranks)
        gas = history("gas")
        full = gas["air_volume"][0] + 5e-5
        near((gas["air_pressure"][-1] + 101325) * gas["air_volume"][-1] ** 1.4 / (101325 * full**1.4), 1, 1e-9, f"{what}: p V^n of the gas")

# it is let go out of shape, and swings: work of the gas is its energy
SWING = (ball("p1", "stable_neohookean") + "-sets inside -effects air -effect_air_type cavity -effect_air_modulus 101325 "
         "-body_s_displacement -0.05*x;0.03*y;0.05*z -time newmark ")
made = []
for step in (1e-4, 5e-5):
    run("swing", SWING + f"-ts_dt {step} -ts_max_time 4e-3", 3)
    swing = history("swing")
    total = swing["kinetic"] + swing["strain"] + swing["air_energy"]
    made.append(abs(total / total[0] - 1).max())
near(made[1], 0, 2e-3, "swinging: energy")
near(made[0] / made[1], 4, 1.2, "its error, over that with half the step")
near(abs(swing["momentum_x"]).max() + abs(swing["momentum_z"]).max(), 0, 1e-9, "swinging: momentum, N s")
run("swing-on", SWING + "-ts_dt 5e-5 -ts_max_time 2e-3 -checkpoint_every_time 2e-3", 3)
run("swing-on", SWING + "-ts_dt 5e-5 -ts_max_time 4e-3 -checkpoint_every_time 2e-3 -restart latest", 1)
filled = scene("air", "p1") + "-effect_air_type cavity -effect_air_added 4e-5*min(t/0.05,1) -time euler_implicit -ts_dt 0.005 -checkpoint_every_time 0.05 -ts_max_time "
run("filled", filled + "0.06", 2)
run("filled-on", filled + "0.05", 2)
run("filled-on", filled + "0.06 -restart latest", 2)
check(history("filled-on")["newton"].max() <= history("filled")["newton"].max() + 1, f"iterations after a restart: {history('filled-on')['newton'][-3:]}, in one run {history('filled')['newton'][-3:]}")
near(last("swing-on")["air_pressure"], swing["air_pressure"][-1], 1e-6 * abs(swing["air_pressure"]).max(), "restart: pressure, Pa")

# an outlet: what is pumped in steadily leaves by it, at last; its equations hold in each step, for a liquid and for a gas
FLOW, R, C, DRAIN = 1e-4, 5e6, 1e-8, 3e6
OUTLET = (scene("air", "p1") + f"-effect_air_type cavity -effect_air_added {FLOW}*t -effect_air_outlet_resistance {R} -effect_air_outlet_compliance {C} "
          f"-effect_air_outlet_drain {DRAIN} -time euler_implicit -ts_dt 0.01 -ts_max_time 0.8 ")
for what, more, n, M in (("liquid", "", 1, 2.2e9), ("gas", "-effect_air_modulus 101325 -effect_air_exponent 1.4 ", 1.4, 101325)):
    run("outlet", OUTLET + more, 2)
    out = history("outlet")
    near(out["air_flow"][-1], FLOW, 1e-3 * FLOW, f"{what}: flow at last, m^3/s")
    near(out["air_pressure"][-1], FLOW * (R + DRAIN), 1e-3 * FLOW * (R + DRAIN), f"{what}: pressure at last, Pa")
    held = out["air_volume"][0] + FLOW * out["time"] - numpy.cumsum(out["air_flow"] * out["dt"])
    near(abs((held / out["air_volume"]) ** n - 1 - out["air_pressure"] / M).max() * M, 0, 1e-5 * 800, f"{what}: pressure of what has not left, Pa, off")
    vessel = C * numpy.diff(out["air_vessel_pressure"]) / out["dt"][1:] + out["air_vessel_pressure"][1:] / DRAIN - out["air_flow"][1:]
    near(abs(vessel).max() / FLOW, 0, 1e-6, f"{what}: balance of the vessel, over the flow")
    check(out["newton"].max() <= 8, f"{what}: {out['newton'].max()} iterations in a step")
run("outlet-on", OUTLET + more + "-ts_max_time 0.3 -checkpoint_every_time 0.3", 1)
run("outlet-on", OUTLET + more + "-ts_max_time 0.8 -checkpoint_every_time 0.3 -restart latest", 3)
near(last("outlet-on")["air_pressure"], out["air_pressure"][-1], 1e-6 * out["air_pressure"][-1], "restart with an outlet: pressure, Pa")
run("valve", OUTLET + "-effect_air_outlet_valve yes -effect_air_outlet_pressure 300 -effect_air_outlet_compliance 0 -effect_air_added 2e-5*sin(10*t)")
valve = history("valve")
check(valve["air_flow"].min() == 0 and valve["air_flow"].max() > 0, f"valve: flow from {valve['air_flow'].min()} to {valve['air_flow'].max()} m^3/s")
check((valve["air_flow"][valve["air_pressure"] < 300] == 0).all() and valve["air_pressure"].min() < 0, "the valve is open below the pressure behind it")

# half of it with a lid on its opening: statics beside the whole; free, it swings and keeps momentum and energy, as its surface is closed
HALF, _ = shell(OUT / "half.msh", 0)
for element in ("p1", "p2"):
    for ranks in (1, 3):
        run("half", scene("air", element).replace(MESH, HALF) + "-effect_air_type cavity -effect_air_added 2.5e-5 -effect_air_lids yes -time static -static_steps 2", ranks)
        run("whole", scene("air", element) + "-effect_air_type cavity -effect_air_added 5e-5 -time static -static_steps 2", ranks)
        what = f"half with a lid, {element}, {ranks} ranks"
        near(last("half")["air_pressure"] / last("whole")["air_pressure"], 1, 0.02, f"{what}: pressure, over that of the whole")
        near(last("half")["air_volume"] / last("whole")["air_volume"], 0.5, 1e-6, f"{what}: volume")
        check(history("half")["newton"].max() <= history("whole")["newton"].max() + 2, f"{what}: {history('half')['newton'].max()} iterations")
LOOSE = SWING.replace(MESH, HALF).replace("-effect_air_modulus 101325", "-effect_air_modulus 101325 -effect_air_lids yes")
made = []
for step in (1e-4, 5e-5):
    run("loose", LOOSE + f"-ts_dt {step} -ts_max_time 4e-3", 2)
    loose = history("loose")
    total = loose["kinetic"] + loose["strain"] + loose["air_energy"]
    made.append(abs(total / total[0] - 1).max())
near(made[1], 0, 5e-3, "half with a lid: energy")
check(made[0] > 2.5 * made[1], f"half with a lid: its error falls from {made[0]:.3g} to {made[1]:.3g} only")
near(sum(abs(loose[f"momentum_{k}"]).max() for k in "xyz"), 0, 1e-9, "half with a lid: momentum, N s")
near(sum(abs(loose[f"angular_{k}"]).max() for k in "xyz"), 0, 1e-6, "half with a lid: angular momentum, N m s")

CAVITY = "-effect_air_type cavity -time static "
ERRORS = ((scene("air", "p1") + CAVITY + "-effect_air_outlet_resistance 1 ", "take another -time"), (scene("air", "p1") + CAVITY + "-effect_air_outlet_valve yes ", "-effect_air_outlet_valve"), (scene("air", "p1") + CAVITY + "-effect_air_lids yes ", "no opening"),
          (scene("air", "p1").replace(MESH, HALF) + CAVITY, "-effect_air_lids yes"), (scene("air", "cr") + CAVITY, "-effect_air_on"), (scene("air", "dg") + CAVITY, "-effect_air_on"),
          (scene("air") + CAVITY + "-effect_air_added -1 ", "-effect_air_added"), (scene("air") + CAVITY + "-effect_air_modulus 1e14 ", "-effect_air_modulus"),
          (scene("air") + CAVITY + "-set_inside_at box:-1,-1,0,1,1,0.041 ", "-effect_air_on"), ("-bodies s " + "-body_s_mesh box:0.1,0.1,0.1:1 -body_s_material linear -body_s_young 1e5 "
          "-body_s_poisson 0.3 -body_s_density 1000 -sets inside -set_inside_at body:s -effects air -effect_air_on inside -effect_air_type cavity ", "-effect_air_on"), (scene("air") + "-effect_air_type cavity -time euler_explicit ", "euler_explicit"))
for options, words in ERRORS:
    text = run("error", options, code=1)
    check(words in text, f"{words}: {text}")

# two shells are chambers with one pressure, unless they are named apart; a body elsewhere is no part of the wall, and one wall has one filling
TWO = ball("p1", "neohookean").replace("-bodies s", "-bodies s,r") + ball("p1", "neohookean").replace("-bodies s ", "").replace("_s_", "_r_") + (
    "-body_r_translate 0.2,0,0 -sets inside,other,stone -set_other_at sphere:0.2,0,0,0.0405 -set_stone_at body:r -effects air -effect_air_type cavity "
    "-effect_air_modulus 101325 -ts_max_time 1e-3 -ts_dt 1e-3 ")
text = run("two", TWO + "-effect_air_on inside,other -quiet no ")
check("2 chambers" in text, text)
near(history("two")["air_volume"][0] / rest, 2, 1e-9, "two chambers: volume, over that of one")
BOX = TWO.replace(f"-body_r_mesh {MESH}", "-body_r_mesh box:0.05,0.05,0.05:1") + "-set_other_at body:r "
CORNER = BOX + "-body_r_translate 0.0255,0.0255,0.0255 -body_r_mesh box:0.004,0.004,0.004:1 -set_other_at body:r "
for options, words in ((BOX + "-effect_air_on inside,stone ", "leave its sets out"), (CORNER + "-effect_air_on inside,stone ", "leave its sets out"), (TWO + "-effects air,more -effect_more_type cavity -effect_more_on inside ", "in common")):
    text = run("error", options, code=1)
    check(words in text, f"{words}: {text}")
near(len(run("within", BOX + "-body_r_translate -0.01,-0.01,-0.01 -body_r_mesh box:0.02,0.02,0.02:1 -set_other_at body:r -effect_air_on inside,stone ")), 0, 0, "a body in the cavity: no message")
finish()
