"""The effect mass: what bodies carry besides their own mass, on a surface or at a point.

A light cube with a mass on its top or at a corner has its weight, its momentum, and its period on a spring, with all elements, on 1 and 3 ranks.
"""
import numpy

from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "
CUBE = "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_material linear -body_a_young 1e7 -body_a_poisson 0.3 -body_a_density 1 -validate -body_a_element {} "
LOAD = "-effect_load_type mass -effect_load_mass 2 "
TOP, POINT = LOAD + "-effect_load_on zmax ", LOAD + "-effect_load_on a -effect_load_at 0.1,0.1,0.1 "


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def last(folder):
    return {name: values[-1] for name, values in history(folder).items()}


for element in ("p1", "p2", "cr", "dg"):
    for ranks in (1, 3):
        for where, load in (("surface", TOP), ("point", POINT)):
            if where == "point" and element in ("cr", "dg"):
                continue
            what = f"{element}, {ranks} ranks, {where}"
            run("weight", CUBE.format(element) + load + "-effects gravity,load,hold -effect_hold_type fixed -effect_hold_on zmin -time static", ranks)
            near(last("weight")["hold_reaction_z"], 2.001 * 9.81, 1e-6, f"{what}: weight, N")
            run("flight", CUBE.format(element) + load + "-effects load -body_a_velocity 1,0,0 -time newmark -ts_dt 1e-3 -ts_max_time 1e-2", ranks)
            near(last("flight")["momentum_x"], 2.001, 1e-9, f"{what}: momentum, N s")
            near(history("flight")["kinetic"][0], 2.001 / 2, 1e-9, f"{what}: kinetic energy, J")

# hung from a spring of 79 N/m: it swings up and down with the period 2 pi sqrt(m / k) = 1 s; half of it is the top of the path
HANG = (CUBE.format("p1") + LOAD.replace("2 ", "1.999 ") + "-effect_load_on zmax,zmin -effects gravity,load,line -effect_line_type spring -effect_line_points 0.05,0.05,0.1;ground:0.05,0.05,1.1 "
        f"-effect_line_stiffness {4 * numpy.pi**2 * 2} -time newmark -ts_dt 0.005 -ts_max_time 1 ")
run("hang", HANG)
z = history("hang")["centre_z"]
near(z[-1], z[0], 2e-4, "on a spring: height after a period, m")
near(z[100] - z[0], -2 * 9.81 / (4 * numpy.pi**2), 1e-3, "way of half of it, m")

ONE = CUBE.format("p1") + "-effects load -effect_load_type mass -effect_load_on zmax -ts_max_time 0.01 "
ERRORS = ((ONE, "-effect_load_mass"), (ONE + "-effect_load_mass 1 -effect_load_density 1 ", "-effect_load_density"), (ONE + "-effect_load_density 1 -effect_load_at 0,0,0 ", "names a point"),
          (ONE + "-effect_load_mass 1 -mass consistent ", "lumped"), (ONE + "-effect_load_mass 1 -body_a_rigid yes ", "is rigid"), (ONE + "-effect_load_mass 1 -remesh_times 0.005 ", "re-meshed"),
          (ONE + "-effect_load_mass 1 -effect_load_at 0,0,0 ", "on one body"))
for options, words in ERRORS:
    text = run("error", options, code=1)
    check(words in text, f"{words}: {text}")
finish()
