"""The effect foundation: springs and dampers per area.

A block sinks by its weight over stiffness and area, with every element, the same on 1 and 3 ranks. With Newmark the energies of motion,
strain and springs add up to what there was, and it bounces with the period of a mass on a spring. A damper of density times speed of sound lets
a wave in a bar out. Stiffness by a formula of the place. What is missing or below zero is an error.
"""
import math

import numpy

from scene_common import check, finish, history, near, start

BLOCK = ("-bodies b -body_b_mesh box:0.2,0.1,0.05:2 -body_b_material {law} -body_b_element {element} -body_b_young {young} -body_b_poisson {nu} "
         "-body_b_density 1000 -effects foam{more} -effect_foam_type foundation -effect_foam_on zmin ")
COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def block(element="p1", law="stable_neohookean", young=1e6, nu=0.3, more=""):
    return BLOCK.format(element=element, law=law, young=young, nu=nu, more=more)


# at rest under its weight: 9.81 N on 0.02 m^2, 2e4 Pa/m: 24.5 mm deep
for element in ("p1", "p2", "cr", "dg"):
    ends = []
    for ranks in (1, 3):
        run(f"rest-{element}", block(element, more=",gravity") + "-effect_foam_stiffness 2e4 -effect_foam_direction all -time static", ranks)
        end = {name: values[-1] for name, values in history(f"rest-{element}").items()}
        near(end["foam_force_z"], 9.81, 1e-6, f"{element}, {ranks} ranks, force")
        near(end["foam_energy"], 9.81**2 / (2 * 2e4 * 0.02), 1e-3, f"{element}, {ranks} ranks, energy")
        near(end["centre_z"], 0.025 - 9.81 / 400, 2e-4, f"{element}, {ranks} ranks, depth")
        ends.append(end)
    near(ends[1]["strain"], ends[0]["strain"], 1e-7 * ends[0]["strain"], f"{element}, 1 and 3 ranks, strain")

# a stiff block bounces as a mass of 1 kg on a spring of 400 N/m, and no energy comes or goes
run("bounce", block(young=1e8, law="linear", nu=0.) + "-body_b_velocity 0,0,0.1 -effect_foam_stiffness 2e4 -time newmark -ts_dt 0.002 -ts_max_time 1")
bounce = history("bounce")
total = bounce["kinetic"] + bounce["strain"] + bounce["foam_energy"]
near(numpy.abs(total / total[0] - 1).max(), 0, 1e-7, "energy while it bounces")
up = bounce["momentum_z"]
cross = [t0 + (t1 - t0) * p0 / (p0 - p1) for t0, t1, p0, p1 in zip(bounce["time"], bounce["time"][1:], up, up[1:]) if p0 > 0 >= p1]
near(numpy.diff(cross).mean(), 2 * math.pi * math.sqrt(1 / 400), 2e-3, "period, s")

# a bar that flies against a damper of density times speed of sound: after 2 L / c = 0.632 s nearly all of its energy is gone
bar = ("-bodies b -body_b_mesh box:1,0.1,0.1:60,1,1 -body_b_material linear -body_b_young 1e4 -body_b_poisson 0 -body_b_density 1000 -body_b_velocity 0.1,0,0 "
       "-effects end -effect_end_type foundation -effect_end_on xmax -effect_end_damping {} -time newmark -ts_dt 0.004 -ts_max_time 0.8")
for name, damping, least, most in (("matched", 1000 * math.sqrt(10), 0, 0.02), ("soft", 300 * math.sqrt(10), 0.1, 0.5)):
    run(name, bar.format(damping))
    wave = history(name)
    left = (wave["kinetic"][-1] + wave["strain"][-1]) / wave["kinetic"][0]
    near(left, (least + most) / 2, (most - least) / 2, f"energy left, damper {name}")

# stiffness by place: a bed that is stiffer on one side tilts, its force is where the springs are
run("formula", block(more=",gravity") + "-effect_foam_stiffness 1e4+1e5*x -effect_foam_direction all -time static")
near(history("formula")["foam_force_z"][-1], 9.81, 1e-6, "force, stiffness by place")

for options, words in (("", "-effect_foam_stiffness"), ("-effect_foam_stiffness x-0.1", "at least 0"), ("-effect_foam_stiffness t", "-effect_foam_time"),
                       ("-effect_foam_stiffness 1 -effect_foam_time cos(9*t)", "-effect_foam_time is -"),
                       ("-effect_foam_stiffness 1 -time euler_explicit", "euler_explicit")):
    text = run("error", block() + options, code=1)
    check(words in text, f"{options}: {text}")
finish()
