"""The effect membrane: a skin on the surface of a soft body, and surface tension.

A skin on a block so soft that it bears nothing is stretched as rubber sheet is, with P1 and P2, on 1 and 3 ranks. Surface tension of a cube compresses it
by the mean of the stress, 2 s A / (3 V). A block with a skin that is let go keeps energy and momentum. What is no skin is an error.
"""
from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "
BLOCK = "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_material {} -body_a_young {} -body_a_poisson {} -body_a_density 1000 -body_a_element {} "
SKIN = "-effect_skin_type membrane -effect_skin_young 1e6 -effect_skin_thickness 1e-4 "


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def last(folder):
    return {name: values[-1] for name, values in history(folder).items()}


# stretched to 1.5 along x and free across: P = h mu (l - 1 / l^2); held across: P = h mu (l - 1 / l^3)
PULL = ("-effects x,y,z,pull,skin -effect_x_type fixed -effect_x_on xmin -effect_x_components x -effect_y_type fixed -effect_y_on {} -effect_y_components y "
        "-effect_z_type fixed -effect_z_on zmin -effect_z_components z -effect_pull_type prescribed_displacement -effect_pull_on xmax -effect_pull_components x "
        "-effect_pull_displacement 0.05;0;0 -effect_skin_on zmax -time static -static_steps 4 ")
for element in ("p1", "p2"):
    for ranks in (1, 3):
        for across, power, name in (("ymin", 2, "free"), ("ymin,ymax", 3, "held")):
            run("pull", BLOCK.format("stable_neohookean", "1e-3", "0.3", element) + SKIN + PULL.format(across), ranks)
            end = last("pull")
            what = f"{element}, {ranks} ranks, {name} across"
            near(end["pull_reaction_x"], 1e-4 * 1e6 / 3 * (1.5 - 1.5**-power) * 0.1, 1e-5, f"{what}: force, N")
            near(end["skin_area"], 0.01 * (1.5 if power == 3 else 1.5**0.5), 1e-7, f"{what}: area, m^2")
            check(end["newton"] <= 8, f"{what}: {end['newton']} iterations")

# surface tension 0.1 N/m all around a cube of bulk modulus K: dV / V = -2 s A / (3 V K)
TENSION = "-effects skin -effect_skin_type membrane -effect_skin_on boundary -effect_skin_tension 0.1 -time static "
for element in ("p1", "p2"):
    run("drop", BLOCK.format("linear", "1e4", "0.3", element) + TENSION + "-effects skin,x,y,z "
        "-sets px,py,pz -set_px_at plane:1,0,0,0.05 -set_py_at plane:0,1,0,0.05 -set_pz_at plane:0,0,1,0.05 "
        + "".join(f"-effect_{k}_type fixed -effect_{k}_on p{k} -effect_{k}_components {k} " for k in "xyz"), 2)
    drop = history("drop")
    near((drop["volume"][-1] / drop["volume"][0] - 1) / (-4 * 0.1 / (0.1 * 1e4 / 1.2)), 1, 2e-3, f"{element}: loss of volume by surface tension, over that expected")

# let go out of shape: energy and momentum
SWING = BLOCK.format("stable_neohookean", "1e4", "0.3", "p2") + SKIN + "-effects skin -effect_skin_on boundary -effect_skin_young 1e7 -body_a_displacement 0.1*x;-0.05*y;0.02*z -time newmark -ts_max_time 0.01 "
made = []
for step in (4e-4, 2e-4):
    run("swing", SWING + f"-ts_dt {step}", 2)
    swing = history("swing")
    total = swing["kinetic"] + swing["strain"] + swing["skin_energy"]
    made.append(abs(total / total[0] - 1).max())
near(made[1], 0, 0.01, "let go: energy")
check(made[0] > 2.5 * made[1], f"its error falls from {made[0]:.3g} to {made[1]:.3g} only")
near(abs(swing["momentum_x"]).max() + abs(swing["momentum_z"]).max(), 0, 1e-9, "let go: momentum, N s")
check(swing["skin_energy"][0] > 0.2 * total[0], f"the skin has {swing['skin_energy'][0]} of {total[0]} J")

ONE = BLOCK.format("linear", "1e4", "0.3", "p1") + "-effects skin,hold -effect_hold_type fixed -effect_hold_on zmin -effect_skin_type membrane -effect_skin_on zmax -time static "
ERRORS = ((ONE, "-effect_skin_tension"), (ONE + "-effect_skin_young 1e5 ", "belong together"), (ONE + "-effect_skin_tension 1 -body_a_element cr ", "p1 or p2"),
          (ONE + "-effect_skin_tension 1 -time euler_explicit ", "euler_explicit"), (ONE + "-effect_skin_young -1 -effect_skin_thickness 1e-3 ", "-effect_skin_young"))
for options, words in ERRORS:
    text = run("error", options, code=1)
    check(words in text, f"{words}: {text}")
finish()
