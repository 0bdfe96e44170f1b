"""The effects spring and cable: lines through points of bodies and of the ground.

A block hangs from a spring, with every element, on 1 and 3 ranks. Two blocks on one swing with the period of the reduced mass; with Newmark no
energy or momentum comes or goes. A damper between them slows them down as a mass on it. A pendulum on a stiff spring keeps its energy, as does one
that a run goes on with from a checkpoint. A cable over two points of the ground is Atwood's machine; slack, it does nothing; shortened or under a
given tension, it lifts. What is missing or makes no sense is an error.
"""
import math

import numpy

from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "
LAW = "-body_{0}_material {1} -body_{0}_element {2} -body_{0}_young {3} -body_{0}_poisson 0.3 -body_{0}_density 1000 "


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def body(name, mesh, young=1e7, law="corotated", element="p1"):
    return f"-body_{name}_mesh box:{mesh} " + LAW.format(name, law, element, young)


def last(folder):
    return {name: values[-1] for name, values in history(folder).items()}


# a block of 1 kg whose sides are guided hangs from a spring of 400 N/m: 9.81 N, 24.5 mm
GUIDED = "-bodies b {} -effects gravity,guide,s{} -effect_guide_type fixed -effect_guide_on b -effect_guide_components xy -effect_s_type spring "
for element in ("p1", "p2", "cr", "dg"):
    ends = []
    block = GUIDED.format(body("b", "0.2,0.1,0.05:2", element=element), "")
    for ranks in (1, 3):
        run(f"hang-{element}", block + "-effect_s_points 0.13,0.05,0.05;ground:0.13,0.05,0.55 -effect_s_stiffness 400 -time static", ranks)
        end = last(f"hang-{element}")
        near(end["s_tension"], 9.81, 1e-7, f"{element}, {ranks} ranks, tension")
        near(end["s_length"], 0.5 + 9.81 / 400, 1e-9, f"{element}, {ranks} ranks, length")
        near(end["s_energy"], 9.81**2 / 800, 1e-8, f"{element}, {ranks} ranks, energy")
        near(end["newton"], 3, 2, f"{element}, {ranks} ranks, iterations")
        ends.append(end)
    near(ends[1]["strain"], ends[0]["strain"], 1e-7 * ends[0]["strain"], f"{element}, 1 and 3 ranks, strain")

# two blocks of 1 and 3 kg on a spring from centre to centre, apart by 0.3 m: reduced mass 0.75 kg, 300 N/m
TWO = ("-bodies a,b " + body("a", "0.1,0.1,0.1:2") + body("b", "0.3,0.1,0.1:2") + "-body_b_translate 0.4,0,0 -effects s -effect_s_type spring "
       "-effect_s_points a:0.05,0.05,0.05;b:0.55,0.05,0.05 ")
run("two", TWO + "-effect_s_stiffness 300 -effect_s_length 0.45 -time newmark -ts_dt 0.002 -ts_max_time 1", 2)
two = history("two")
total = two["kinetic"] + two["strain"] + two["s_energy"]
near(numpy.abs(total / total[0] - 1).max(), 0, 1e-4, "two blocks: energy")
speed = numpy.abs(two["momentum_x"]).max() + numpy.abs(two["momentum_y"]).max()
near(speed, 0, 1e-9, "two blocks: momentum")
stretch = two["s_length"] - 0.45
cross = [t0 + (t1 - t0) * p0 / (p0 - p1) for t0, t1, p0, p1 in zip(two["time"], two["time"][1:], stretch, stretch[1:]) if p0 > 0 >= p1]
near(numpy.diff(cross).mean(), 2 * math.pi * math.sqrt(0.75 / 300), 1e-3, "two blocks: period, s")

# a damper of 30 N s/m: the relative speed falls as exp(-c t / m), m = 0.75 kg
run("damper", TWO + "-effect_s_damping 30 -body_a_young 1e10 -body_b_young 1e10 -body_a_velocity 1,0,0 -time newmark -ts_dt 0.0005 -ts_max_time 0.05")
damper = last("damper")
near(damper["s_tension"], -30 * math.exp(-30 * 0.05 / 0.75), 0.05, "damper: tension, N")

# a pendulum on a stiff spring of 1 m: it swings through 60 degrees, and keeps its energy; its spring feels the rotation
SWING = ("-bodies b " + body("b", "0.1,0.1,0.1:2") + "-effects gravity,s -effect_s_type spring -effect_s_points 0.05,0.05,0.05;ground:1.05,0.05,0.05 "
         "-effect_s_stiffness 1e4 -time newmark -ts_dt 0.005 -ts_max_time 0.6 ")
# a damper to a point of the ground that moves away at 1 m/s draws the block of 1 kg along: v = 1 - exp(-c t / m)
run("drawn", GUIDED.format(body("b", "0.2,0.1,0.05:2"), "").replace("gravity,", "") + "-effect_s_points 0.1,0.05,0.05;ground:0.1,0.05,0.55 -effect_s_damping 5 "
    "-effect_s_displacement 0;0;t -time newmark -ts_dt 0.002 -ts_max_time 0.4", 2)
near(last("drawn")["momentum_z"], 1 - numpy.exp(-2), 2e-3, "block drawn along by a damper: momentum, N s")

run("swing", SWING + "-checkpoint_every_time 0.3", 2)
swing = history("swing")
total = swing["kinetic"] + swing["strain"] + swing["s_energy"] + 9.81 * swing["centre_z"]
near(numpy.abs(total - total[0]).max(), 0, 0.02, "pendulum: energy, J")
near(swing["s_length"].max(), 1, 0.01, "pendulum: length")

# Atwood: 1 and 3 kg on a cable over two points of the ground: a = g / 2, both hang
ATWOOD = ("-bodies a,b " + body("a", "0.1,0.1,0.1:2") + body("b", "0.1,0.1,0.3:2") + "-body_a_translate -0.55,-0.05,-1 -body_b_translate 0.45,-0.05,-1.2 "
          "-effects gravity,s -effect_s_points a:-0.5,0,-0.9;ground:-0.5,0,0;ground:0.5,0,0;b:0.5,0,-0.9 -effect_s_type cable ")
run("atwood", ATWOOD + "-effect_s_stiffness 1e5 -effect_s_damping 100 -time euler_implicit -ts_dt 0.0005 -ts_max_time 0.2")
atwood = last("atwood")
near(atwood["s_tension"], 1.5 * 9.81, 0.1, "Atwood: tension, N")
near(atwood["momentum_z"], (1 - 3) * 9.81 / 2 * 0.2, 0.02, "Atwood: momentum, N s")

# a cable longer than the way is slack and does nothing; a spring of that length pushes
FREE = "-bodies b " + body("b", "0.1,0.1,0.1:2") + "-effects s -effect_s_points 0.05,0.05,0.1;ground:0.05,0.05,0.6 -effect_s_stiffness 100 -effect_s_length 0.6 "
FREE += "-time newmark -ts_dt 0.01 -ts_max_time 0.05 -effect_s_type "
run("slack", FREE + "cable -body_b_velocity 0,0,-1")
slack = last("slack")
near(slack["momentum_z"], -1, 1e-9, "slack cable: momentum, N s")
near(slack["s_tension"] + slack["s_energy"], 0, 0, "slack cable: tension and energy")
run("push", FREE + "spring")
near(history("push")["s_tension"][0], -10, 1e-9, "spring that is too long: tension, N")
run("let-go", FREE + "spring -effect_s_until 0.02")
near(history("let-go")["s_tension"][2], -10, 1, "spring that lets go, before: tension, N")
near(abs(history("let-go")["s_tension"][3:]).max() + abs(history("let-go")["s_energy"][3:]).max(), 0, 0, "after: tension and energy")

# given tension, ramped by the load factor, or a shorter length: both lift the guided block onto its support's side
run("pull", GUIDED.format(body("b", "0.2,0.1,0.05:2", young=1e5), ",feet -effect_feet_type fixed -effect_feet_on zmin")
    + "-effect_s_type cable -effect_s_points 0.1,0.05,0.05;ground:0.1,0.05,0.55 -effect_s_tension 3 -time static -static_steps 2")
pull = history("pull")
near(pull["s_tension"][1], 1.5, 1e-12, "given tension at half the load, N")
near(pull["feet_reaction_z"][-1], 9.81 - 3, 1e-6, "reaction under it, N")
run("short", GUIDED.format(body("b", "0.2,0.1,0.05:2"), "") + "-effect_s_points 0.13,0.05,0.05;ground:0.13,0.05,0.55 -effect_s_stiffness 400 "
    "-effect_s_length 0.3 -effect_s_displacement 0;0;0.1 -time static -static_steps 2")
near(last("short")["s_length"], 0.3 + 9.81 / 400, 1e-9, "shortened spring")
near(last("short")["centre_z"], 0.025 + 0.1 + 0.2 - 9.81 / 400, 1e-3, "height of what it lifts")

# a run that goes on from a checkpoint is the same run
run("swing-on", SWING.replace("0.6 ", "0.3 ") + "-checkpoint_every_time 0.3", 2)
run("swing-on", SWING + "-checkpoint_every_time 0.3 -restart latest", 2)
near(last("swing-on")["s_tension"], swing["s_tension"][-1], 1e-6 * abs(swing["s_tension"][-1]), "restart: tension")

ERRORS = (("", "-effect_s_points"), ("-effect_s_points 0.1,0,0", "one point"), ("-effect_s_points 0,0,0;1,0", "point 2"),
          ("-effect_s_points 0,0,0;c:1,0,0 -effect_s_stiffness 1", "no body \"c\""),
          ("-effect_s_points ground:0,0,0;ground:1,0,0 -effect_s_stiffness 1", "all points are of the ground"),
          ("-effect_s_points 0,0,0;0.2,0.1,0", "-effect_s_stiffness"),
          ("-effect_s_points 0,0,0;ground:0,0,0 -effect_s_tension 1", "points 1 and 2 are one place"),
          ("-effect_s_points 0,0,0;0.2,0.1,0 -effect_s_tension 1 -effect_s_length 1", "-effect_s_length"),
          ("-effect_s_points 0,0,0;0.2,0.1,0 -effect_s_tension 1 -effect_s_displacement 1;0;0", "ground: x,y,z"),
          ("-effect_s_points 0,0,0;0.2,0.1,0 -effect_s_stiffness 1 -effect_s_length t-1", "at least 0"),
          ("-effect_s_points 0,0,0;0.2,0.1,0 -effect_s_stiffness 1 -time euler_explicit", "euler_explicit"))
for options, words in ERRORS:
    text = run("error", "-bodies b " + body("b", "0.2,0.1,0.05:2") + "-effects s -effect_s_type spring " + options, code=1)
    check(words in text, f"{options}: {text}")
text = run("overlap", "-bodies a,b " + body("a", "0.1,0.1,0.1:2") + body("b", "0.1,0.1,0.1:2") + "-body_b_translate 0.1,0,0 -effects s -effect_s_type spring "
           "-effect_s_points 0.1,0,0;ground:1,0,0 -effect_s_stiffness 1", code=1)
check("bodies a and b" in text and "b:0.1,0" in text, text)
text = run("named", "-bodies ground " + body("ground", "0.1,0.1,0.1:2") + "-effects s -effect_s_type spring -effect_s_points 0,0,0;ground:1,0,0 -effect_s_stiffness 1", code=1)
check("a body of that name" in text, text)
text = run("outside", "-bodies b " + body("b", "0.1,0.1,0.1:2") + "-effects s -effect_s_type spring -effect_s_points 0.05,0.05,0.13;ground:0,0,1 "
           "-effect_s_stiffness 1 -ts_max_time 0.01")
check("0.03 m outside of body b" in text, text)
finish()
