"""The effect periodic: a cell of a material that repeats, with a mean strain.

A body of one material has the stress of its law, at small and large strains, with components that are given or free, every element, on 1 and 3 ranks, and
with sides whose meshes do not match. A laminate has the closed form of its layers. The moduli of a checkerboard and of a cube in a matrix lie between the
bounds of Hashin and Shtrikman. A strain that grows gives the same numbers after a restart, and its work is the strain energy. A standing shear wave has its
period and keeps its energy. Weight without a support shows in a column. Cells that are none, or that contradict themselves, are an error.
"""
import numpy

from output_common import OUT
from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "
CELL = ("-bodies a -body_a_mesh box:0.1,0.1,0.1:{} -body_a_material {} -body_a_element {} -body_a_young 1e4 -body_a_poisson 0.3 -body_a_density 1000 "
        "-effects cell -effect_cell_type periodic -time static ")
LAMBDA, MU = 1e4 * 0.3 / (1.3 * 0.4), 1e4 / 2.6
ELEMENTS = ("p1", "p2", "cr", "dg")


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def last(folder):
    return {name: values[-1] for name, values in history(folder).items()}


def tensor(end, what):
    return numpy.array([[end[f"cell_{what}_{i}{j}"] for j in "xyz"] for i in "xyz"])


def given(gradient):
    return "-effect_cell_gradient " + ";".join(f"{value:g}" for value in numpy.ravel(gradient)) + " "


def same(one, other, tolerance, what):
    """Two tensors, relative to the second one."""
    near(abs(one - other).max() / abs(other).max(), 0, tolerance, what)


# one material: Hooke's law, all components given, and some of them free
SMALL = numpy.array([[0.01, 0.002, 0], [0.003, -0.003, 0], [0, 0.001, 0.004]])
strain = (SMALL + SMALL.T) / 2
hooke = LAMBDA * numpy.trace(strain) * numpy.eye(3) + 2 * MU * strain
PULL = numpy.array([[0.01, 0.002, 0], [0.002, 0, 0], [0, 0, 0]])
pulled = numpy.array([[100, 2 * MU * 0.002, 0], [2 * MU * 0.002, 0, 0], [0, 0, 0]])
for element in ELEMENTS:
    for ranks in (1, 3):
        what = f"{element}, {ranks} ranks"
        run("even", CELL.format(2, "linear", element) + given(SMALL), ranks)
        end = last("even")
        same(tensor(end, "stress"), hooke, 1e-7, f"{what}: stress")
        same(tensor(end, "gradient"), SMALL, 1e-7, f"{what}: gradient")
        near(end["cell_work"] / end["strain"], 1, 1e-9, f"{what}: work over strain energy")
        near(abs(end["cell_hold_x"]) + abs(end["cell_hold_z"]), 0, 1e-10, f"{what}: force that holds the cell, N")
        check(end["newton"] <= 5, f"{what}: {end['newton']} iterations")
        if ranks == 1:
            continue
        run("free", CELL.format(2, "linear", element) + given(PULL) + "-effect_cell_free yy,zz,yz ", ranks)
        end = last("free")
        same(tensor(end, "stress"), pulled, 2e-7, f"{what}, free across: stress")
        near(end["cell_gradient_yy"], -0.003, 1e-9, f"{what}, free across: contraction")

# large strains: P = F S of Saint Venant and Kirchhoff, with a turn in the gradient
LARGE = numpy.array([[0.3, 0.4, 0], [-0.1, 0.1, 0.05], [0, 0, 0.2]])
F = numpy.eye(3) + LARGE
green = (F.T @ F - numpy.eye(3)) / 2
exact = F @ (LAMBDA * numpy.trace(green) * numpy.eye(3) + 2 * MU * green)
run("large", CELL.format(2, "stvk", "p2") + given(LARGE) + "-static_steps 2 ", 2)
same(tensor(last("large"), "stress"), exact, 1e-6, "Saint Venant and Kirchhoff: stress")

# near nu = 0.5 the sides are soft beside the bulk modulus
run("bulky", CELL.format(2, "linear", "p2") + "-body_a_poisson 0.499 " + given(numpy.diag([0.01, 0, 0])))
check(last("bulky")["newton"] <= 5, "nu = 0.499: iterations")
near(last("bulky")["cell_stress_xx"] / (1e4 * 0.501 / (1.499 * 0.002) * 0.01), 1, 1e-6, "nu = 0.499: stress over that expected")

# a block of 2 and one of 3 cells across, glued: the sides along x do not match, others are of both; the glue yields by 1 / k
GLUED = ("-bodies a,b -body_a_mesh box:0.05,0.1,0.1:1,2,2 -body_b_mesh box:0.05,0.1,0.1:2,3,3 -body_b_translate 0.05,0,0 -effects cell,glue -effect_glue_type tie "
         "-effect_glue_on b.xmin -effect_glue_to a.xmax -effect_glue_stiffness 1e9 -effect_cell_type periodic -effect_cell_free yy,zz -time static "
         + "".join(f"-body_{b}_material linear -body_{b}_young 1e6 -body_{b}_poisson 0.3 -body_{b}_density 1000 " for b in "ab") + given(numpy.diag([0.01, 0, 0])))
for pair in (("p1", "p1"), ("p2", "cr"), ("dg", "p1")):
    run("glued", GLUED + f"-body_a_element {pair[0]} -body_b_element {pair[1]} ", 3)
    near(last("glued")["cell_stress_xx"], 0.001 / (0.1 / 1e6 + 1e-9), 0.01, f"{pair[0]} and {pair[1]}, sides that do not match: stress, Pa")

# a laminate along z of 1e4 Pa, 0.3, and 1e5 Pa, 0.2
LAYERS = ("-sets low -set_low_at box:-1,-1,-1,1,1,0.05 -body_a_inclusions low -inclusion_low_material linear -inclusion_low_young 1e5 -inclusion_low_poisson 0.2 ")
lame = numpy.array([[LAMBDA, MU], [1e5 * 0.2 / (1.2 * 0.6), 1e5 / 2.4]])
stiff = lame[:, 0] + 2 * lame[:, 1]
across = (0.01 + (lame[:, 0] * 0.01 / stiff).mean()) / (1 / stiff).mean()  # sigma_zz = (lambda + 2 mu) e_zz + lambda e_xx is one for both
e = (across - lame[:, 0] * 0.01) / stiff
along = (lame[:, 0] * (0.01 + e) + 2 * lame[:, 1] * 0.01).mean()
for element in ELEMENTS:
    run("layers", CELL.format(2, "linear", element) + LAYERS + given(numpy.diag([0.01, 0, 0.01])), 2)
    end = last("layers")
    near(end["cell_stress_zz"] / across, 1, 1e-7, f"laminate, {element}: stress across the layers over that expected")
    near(end["cell_stress_xx"] / along, 1, 1e-7, f"laminate, {element}: along the layers")
    run("layers", CELL.format(2, "linear", element) + LAYERS + given([[0, 0, 0.01], [0, 0, 0], [0, 0, 0]]), 2)
    near(last("layers")["cell_stress_xz"] * (1 / lame[:, 1]).mean(), 0.01, 1e-8, f"laminate, {element}: shear across the layers")
    run("layers", CELL.format(2, "linear", element) + LAYERS + given([[0, 0.01, 0], [0, 0, 0], [0, 0, 0]]), 2)
    near(last("layers")["cell_stress_yx"] / lame[:, 1].mean(), 0.01, 1e-8, f"laminate, {element}: shear along the layers")


def bounds(f, soft, hard):
    """Of Hashin and Shtrikman, bulk and shear modulus: f the share of the second one of two materials (K, G)."""
    for one, two, g in ((soft, hard, f), (hard, soft, 1 - f)):
        K, G = one
        yield (K + g / (1 / (two[0] - K) + 3 * (1 - g) / (3 * K + 4 * G)), G + g / (1 / (two[1] - G) + 6 * (1 - g) * (K + 2 * G) / (5 * G * (3 * K + 4 * G))))


soft, hard = ((lam + 2 * mu / 3, mu) for lam, mu in lame)
BOXES = {"checkerboard": (0.5, ("0,0,0,1,1,1", "0,1,1,1,2,2", "1,0,1,2,1,2", "1,1,0,2,2,1"), 4), "cube in a matrix": (1 / 8, ("0.5,0.5,0.5,1.5,1.5,1.5",), 4)}
for name, (share, boxes, n) in BOXES.items():
    parts = [f"p{k}" for k in range(len(boxes))]
    scene = f"-sets {','.join(parts)} -body_a_inclusions {','.join(parts)} " + "".join(
        f"-set_{p}_at box:{','.join(str(0.05 * float(x)) for x in box.split(','))} -inclusion_{p}_material linear -inclusion_{p}_young 1e5 -inclusion_{p}_poisson 0.2 "
        for p, box in zip(parts, boxes))
    (k0, g0), (k1, g1) = bounds(share, soft, hard)
    run("mixed", CELL.format(n, "linear", "p2") + scene + given(0.01 * numpy.eye(3)))
    bulk = numpy.trace(tensor(last("mixed"), "stress")) / 0.09
    run("mixed", CELL.format(n, "linear", "p2") + scene + given([[0, 0.01, 0], [0.01, 0, 0], [0, 0, 0]]))
    shear = last("mixed")["cell_stress_xy"] / 0.02
    print(f"{name}: bulk modulus {bulk:.5g} in {k0:.5g} to {k1:.5g} Pa, shear modulus {shear:.5g} in {g0:.5g} to {g1:.5g} Pa")
    check(k0 < bulk < k1 and g0 < shear < g1, f"{name}: moduli {bulk:.5g} and {shear:.5g} Pa are out of bounds")

# a stretch that grows, of a laminate at large strains; the same from a checkpoint in the middle
GROW = CELL.format(2, "stable_neohookean", "p2") + LAYERS.replace("material linear", "material stable_neohookean") + "-static_steps 8 -checkpoint_every_steps 4 -checkpoint_keep 9 "
GROW += "-effect_cell_gradient 0.4*t;0;0.3*t^2;0;0;0;0;0;0 -effect_cell_free yy,zz "
run("grow", GROW)
grow = history("grow")
near(grow["cell_work"][-1] / grow["strain"][-1], 1, 0.02, "stretch of a laminate: work over strain energy")
near(grow["cell_work"][-1] / grow["load_work"][-1], 1, 1e-6, "work of the mean stress over that of all loads")
middle = sorted(path.name for path in (OUT / "grow").glob("checkpoint_*.h5"))[0]
run("grow-on", GROW + f"-restart {OUT / 'grow' / middle} ", 3)
on = last("grow-on")
for name in ("cell_stress_xx", "cell_stress_xz", "cell_work", "cell_gradient_zz", "strain"):
    near(on[name] / grow[name][-1], 1, 1e-6, f"from a checkpoint: {name}")

# a standing shear wave over the cell: kinetic energy by cos^2 of 2 pi c t / L
SPEED = (MU / 1000) ** 0.5
PERIOD = 0.1 / SPEED
WAVE = (CELL.format("12,4,4", "linear", "p1").replace("-time static ", "-time newmark ") + f"-body_a_velocity 0;0.01*sin(62.8318530717959*x);0 -ts_dt {PERIOD / 80} -ts_max_time {PERIOD / 2} ")
run("wave", WAVE, 2)
wave = history("wave")
total = wave["kinetic"] + wave["strain"] + wave["cell_energy"]
near(abs(total / total[0] - 1).max(), 0, 1e-6, "standing wave: energy")
near(wave["kinetic"][20] / total[0], 0, 5e-3, "standing wave: kinetic energy after a quarter of its period, over all")
near(wave["kinetic"][-1] / total[0], 1, 0.01, "after half of it")
run("wave", WAVE.replace("-effects cell -effect_cell_type periodic ", ""), 2)
check(history("wave")["kinetic"][20] > 0.01 * total[0], "a body that is free at its sides has the same wave")

# weight without a support
run("heavy", CELL.format(2, "linear", "p1") + "-effects cell,gravity ")
near(last("heavy")["cell_hold_z"], 9.81, 1e-6, "weight of 1 kg: force that holds the cell, N")
run("heavy", CELL.format(2, "linear", "p1") + "-effects cell,gravity,bed -effect_bed_type fixed -effect_bed_on low -sets low -set_low_at box:0.04,0.04,0.04,0.06,0.06,0.06 ")
near(abs(last("heavy")["cell_hold_z"]), 0, 1e-12, "with a support: force that holds the cell, N")

ONE = CELL.format(2, "linear", "p1")
TWO = ("-bodies a,b " + "".join(f"-body_{b}_material linear -body_{b}_young 1e4 -body_{b}_poisson 0.3 -body_{b}_density 1000 " for b in "ab")
       + "-body_a_mesh box:0.1,0.1,0.1:1 -body_b_mesh box:0.1,0.1,0.05:1 -body_b_translate 0.1,0,0 -effects cell -effect_cell_type periodic -time static ")
ERRORS = ((ONE + "-body_a_rotate 0,0,1,10 ", "no facet of these sets lies in the plane x ="), (TWO, "do not match"),
          (TWO.replace("box:0.1,0.1,0.05", "box:0.1,0.1,0.1").replace("0.1,0,0", "0.1,0.02,0"), "do not match"),
          (ONE + "-effect_cell_on nowhere ", "nowhere"), (ONE + "-effect_cell_on a.xmin,a.xmax ", "no facet of these sets lies in the plane y ="),
          (ONE + "-effect_cell_free xw ", '"xw" is no component'), (ONE + "-effect_cell_free xy,yx ", "both free"), (ONE + "-effect_cell_free xx " + given(SMALL), "leave one out"),
          (ONE + "-effect_cell_axes xy " + given(SMALL), "does not tie"), (ONE + "-effect_cell_axes x " + given(numpy.diag([0.01, 0, 0])), "nothing holds the body a"),
          (ONE + "-time euler_explicit ", "euler_explicit"), (ONE.replace("-time static", "-ts_max_time 0.01 -remesh_times 0.005"), "-remesh_ out"), (ONE + "-effect_cell_gradient x;0;0;0;0;0;0;0;0 ", "not x, y or z"), (ONE + "-effect_cell_stiffness -1 ", "-effect_cell_stiffness"),
          (ONE + "-effects cell,across -effect_cell_axes x -effect_across_type periodic -effect_across_axes y ", "cell and across are both periodic"))
for options, words in ERRORS:
    text = run("error", options, code=1)
    check(words in text, f"{words}: {text}")
finish()
