"""Rigid bodies.

A torque-free asymmetric top keeps energy and angular momentum, a symmetric one precesses under a force on its axis as its closed form says; a torque
gives a box its angular momentum, another one swings on a spring. A block slides down a slope, another one sticks. A rigid box lies on a soft block, which bears its weight, the same on 1 and 2 ranks, and after a restart on
other ranks; supports hold a rigid body as a whole, let go of it, and press it on the block in a static run. A house of cards stands, a row of
dominoes falls. What rigid bodies do not go with is an error, a stiffness that is too low a warning.
"""
import math

import h5py
import numpy

from output_common import OUT
from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double "


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def momentum(found, k):
    return numpy.array([found[f"angular_{axis}"][k] for axis in "xyz"])


# a box that spins about no axis of its own: 0.05 rad a step; energy and angular momentum stay, the axis in the body does not
spin = "-bodies b -body_b_rigid yes -body_b_angular_velocity 1,10,2 -body_b_velocity 0.3,0,0 -ts_dt 0.005 -ts_max_time 1 -snes_rtol 1e-10 "
box = "-body_b_mesh box:0.2,0.4,0.6:2 "
for integrator, energy, turn in (("newmark", 2e-4, 5e-4), ("genalpha", 3e-3, 2e-3)):
    run(f"free-{integrator}", spin + box + f"-time {integrator}")
    free = history(f"free-{integrator}")
    mass, moments = 48, numpy.array([0.52, 0.40, 0.20]) * 4
    near(free["kinetic"][0], 0.5 * (moments * numpy.array([1, 10, 2])**2).sum() + 0.5 * mass * 0.09, 1e-9, "kinetic energy at the start")
    near(free["kinetic"][-1] / free["kinetic"][0], 1, energy, f"kinetic energy at the end, {integrator}")
    centre = numpy.array([0.1 + 0.3, 0.2, 0.3])
    along = mass * numpy.array([0.3, 0, 0])
    change = momentum(free, -1) - numpy.cross(centre, along) - (momentum(free, 0) - numpy.cross(centre - (0.3, 0, 0), along))
    near(numpy.abs(change).max() / 16, 0, turn, f"change of the angular momentum, {integrator}")
    near(free["centre_x"][-1], 0.4, 1e-6, f"path, {integrator}")

# the axis of a symmetric top, whose centre flies: the couple of the force on its end turns it by M / (I3 w3); steady, as it begins with that
couple, axial = 1000 * 0.05, 500 * 0.1 * 0.16 * 0.32 / 12 * 60
top = ("-bodies b -body_b_mesh box:0.1,0.4,0.4:1,2,2 -body_b_translate -0.05,-0.2,-0.2 -body_b_rigid yes -body_b_density 500 -sets tip -set_tip_at "
       f"box:0.049,-0.001,-0.001,0.051,0.001,0.001 -body_b_angular_velocity 60,0,{couple / axial} -effects f -effect_f_type point_force -effect_f_on tip "
       "-effect_f_vector 0;0;-1000 -time newmark -ts_dt 0.0005 -ts_max_time 0.5 -probes tip,back -probe_tip_at 0.05,0,0 -probe_back_at -0.05,0,0 ")
run("top", top)
found = history("top")
axis = numpy.array([found[f"tip_u{k}"] - found[f"back_u{k}"] + (0.1 if k == "x" else 0) for k in "xyz"])
near(numpy.unwrap(numpy.arctan2(axis[1], axis[0]))[-1] / 0.5 / (couple / axial), 1, 1e-3, "precession")
near(numpy.abs(axis[2]).max() / 0.1, 0, 1e-3, "nutation")
near(found["centre_z"][-1], -0.5 * 1000 / 8 * 0.25, 1e-3, "fall of the centre")

# a torque in space on a box at rest: its angular momentum is that times t, with no force; and the work is the energy
run("torque", box + "-bodies b -body_b_rigid yes -effects motor -effect_motor_type torque -effect_motor_vector 1;0;2 -time newmark -ts_max_time 1 "
    "-ts_dt 0.01 -snes_rtol 1e-10")
found = history("torque")
near(numpy.abs(momentum(found, -1) - (1, 0, 2)).max(), 0, 1e-3, "angular momentum of a torque less torque times time")
near(found["centre_x"][-1], 0.1, 1e-9, "centre of what a torque turns")
near(found["load_work"][-1] / (found["kinetic"][-1] + found["strain"][-1]), 1, 1e-3, "work of the torque")

# a box of 2 kg on a spring, let go: it falls by 2 m g / k, and is back after 2 pi sqrt(m / k)
run("spring", "-bodies b -body_b_rigid yes -body_b_density 2000 -body_b_mesh box:0.1,0.1,0.1:2 -effects gravity,s -effect_s_type spring -effect_s_points "
    "0.05,0.05,0.1;ground:0.05,0.05,0.4 -effect_s_stiffness 500 -time newmark -ts_dt 0.002 -ts_max_time 0.5 -snes_rtol 1e-10")
found = history("spring")
near(found["s_length"].max() - 0.3, 2 * 2 * 9.81 / 500, 1e-5, "way of a box on a spring")
near(found["time"][100 + found["s_length"][100:].argmin()], 2 * math.pi * math.sqrt(2 / 500), 2e-3, "its period")

# two blocks on slopes of 14 and 20 degrees with friction 0.3, as in scenarios/incline.opts: implicit Euler slides a t (t + dt) / 2
slope = ("-bodies held,gone -body_default_rigid yes -body_held_mesh box:0.1,0.1,0.05:2 -body_held_rotate 0,1,0,14 -body_gone_mesh box:0.1,0.1,0.05:2 "
         "-body_gone_rotate 0,1,0,20 -body_gone_translate 0,0.2,0 -effects gravity,gentle,steep -effect_gentle_type contact -effect_gentle_on held "
         "-effect_gentle_obstacle plane:0.2419218956,0,0.9702957263,0 -effect_gentle_friction 0.3 -effect_steep_type contact -effect_steep_on gone "
         "-effect_steep_obstacle plane:0.3420201433,0,0.9396926208,0 -effect_steep_friction 0.3 -probes held,gone -probe_held_at 0.05,0.05,0 "
         "-probe_gone_at 0.05,0.25,0 -ts_max_time 0.5 -ts_dt 0.01 ")
run("slope", slope)
found = history("slope")
angle = math.radians(20)
way = 9.81 * (math.sin(angle) - 0.3 * math.cos(angle)) * 0.5 * 0.51 / 2
near(found["gone_ux"][-1], way * math.cos(angle), 0.01 * way, "slide")
near(found["held_ux"][-1], 0, 1e-4, "what sticks")
near(found["gentle_force_z"][-1], 4.905, 1e-5, "weight on the gentle slope")
near(found["steep_force_z"][-1], 4.905 * math.cos(angle) * (math.cos(angle) + 0.3 * math.sin(angle)), 1e-2, "force of the steep slope")

# a box falls askew on a soft block; restart on another number of ranks
bed = ("-bodies bed,box -body_bed_mesh box:0.1,0.1,0.05:3 -body_bed_material stable_neohookean -body_bed_young 1e5 -body_bed_poisson 0.4 "
       "-body_box_mesh box:0.04,0.04,0.04:2 -body_box_rigid yes -body_box_density 3000 -effects {} -effect_hold_type fixed -effect_hold_on bed.zmin "
       "-effect_meet_type contact -effect_meet_friction 0.3 -effect_meet_verify yes -effect_meet_pairs yes ")
fall = bed.format("gravity,hold,meet") + "-body_box_rotate 1,1,0,10 -body_box_translate 0.03,0.03,0.07 -ts_dt 0.005 -ts_max_time 0.5 "
weight = 3000 * 0.04**3 * 9.81
ends = []
for ranks in (1, 2):
    run(f"fall{ranks}", fall + "-checkpoint_every_steps 20", ranks)
    ends.append({name: values[-1] for name, values in history(f"fall{ranks}").items()})
    near(ends[-1]["hold_reaction_z"], weight + 4.905, 1e-5, f"reaction, {ranks} ranks")
    near(ends[-1]["meet_bed_box_force_z"], weight, 1e-5, f"weight on the block, {ranks} ranks")
near(ends[1]["strain"], ends[0]["strain"], 1e-7 * ends[0]["strain"], "strain energy, 1 and 2 ranks")
near(ends[1]["centre_x"], ends[0]["centre_x"], 1e-9, "centre, 1 and 2 ranks")
run("fall1", fall + "-restart latest -ts_max_time 0.52", 2)
run("fall2", fall + "-ts_max_time 0.52 -output_overwrite")
one, two = history("fall1"), history("fall2")
near(one["centre_z"][-1], two["centre_z"][-1], 1e-12, "centre after a restart")

# fields of its mesh: it keeps its shape, the contact forces add up to its weight, and what is not known is not a number
start("fields", fall + "-quiet -output_precision double -output_fields position,contact_force,contact_pressure,contact_gap,stress", 2)
with h5py.File(OUT / "fields" / "fields.h5") as file:
    points = numpy.unique(file["mesh/cells"][...][file["mesh/body"][...] == 1])
    rest = file["mesh/x"][...][points]
    steps = file["step"][max(file["step"])]
    frame = {name: values[...] for name, values in steps[max(steps)].items()}
place = frame["position"][points]
turn = numpy.linalg.lstsq(numpy.c_[rest, numpy.ones(len(rest))], place, rcond=None)[0]
near(numpy.abs(turn[:3] @ turn[:3].T - numpy.eye(3)).max(), 0, 1e-5, "shape of the box in the frames")
near(frame["contact_force"][points].sum(axis=0)[2], weight, 1e-4, "contact force in the frames")
near(frame["contact_force"].sum(axis=0)[2], 0, 1e-4, "contact force of box and block")
for name in "contact_pressure", "contact_gap":
    check(numpy.isnan(frame[name][points]).all(), f"{name} of a rigid body")
    check(numpy.isfinite(numpy.delete(frame[name], points, axis=0)).all(), f"{name} of a soft body")

# held as a whole, turned and pressed, then let go
hand = (bed.format("gravity,hold,hand,meet") + "-body_box_translate 0.03,0.03,0.052 -effect_hand_type prescribed_displacement -effect_hand_on box "
        "-effect_hand_displacement 0;0;-0.06*t -effect_hand_angle 90*t -effect_hand_axis_point 0.05,0.05,0 -effect_hand_until 0.1 -ts_dt 0.01 "
        "-ts_max_time 0.5 -probes corner -probe_corner_at 0.07,0.05,0.052 ")
run("hand", hand)
found = history("hand")
turned = int(round(0.1 / 0.01))
near(found["corner_ux"][turned], 0.02 * (math.cos(math.radians(9)) - 1), 1e-12, "corner of the turned box, x")
near(found["corner_uy"][turned], 0.02 * math.sin(math.radians(9)), 1e-12, "corner of the turned box, y")
check(found["hand_reaction_z"][turned] < -5, "the hand does not press")
near(found["hold_reaction_z"][-1], weight + 4.905, 1e-2, "reaction after it is let go")

# static: pressed by a support, and by a force
press = (bed.format("hold,hand,meet") + "-body_box_translate 0.03,0.03,0.0501 -effect_hand_type prescribed_displacement -effect_hand_on box "
         "-effect_hand_displacement 0;0;-0.005*t -time static -static_steps 5 -effect_meet_friction 0 -checkpoint_every_steps 2 -checkpoint_keep 9 ")
run("press", press)
found = history("press")
run("press", press + f"-restart {OUT / 'press' / 'checkpoint_000002.h5'}")
near(history("press")["prescribed_work"][-1] / found["prescribed_work"][-1], 1, 1e-9, "work of a hand that touches, after a restart")
near(found["hand_reaction_z"][-1], -found["hold_reaction_z"][-1], 1e-6, "reactions of hand and block")
check(found["hold_reaction_z"][-1] > 30, "the block is not pressed")
run("push", bed.format("gravity,hold,push,guide,meet") + "-body_box_translate 0.03,0.03,0.05 -effect_push_type traction -effect_push_on box.zmax "
    "-effect_push_total 0,0,-3 -effect_guide_type fixed -effect_guide_on box -effect_guide_components xy -time static -static_steps 5")
near(history("push")["hold_reaction_z"][-1], weight + 4.905 + 3, 1e-5, "reaction under weight and force")

# a house of cards on the ground: two that lean on each other, 15 degrees from upright, stay; dominoes fall in turn, the last one as well
cards = ("-body_default_rigid yes -body_default_density 800 -effects gravity,ground,meet -effect_ground_type contact -effect_ground_obstacle "
         "plane:0,0,1,0 -effect_ground_friction {0} -effect_meet_type contact -effect_meet_friction {0} -effect_meet_verify yes -ts_dt 0.005 ")
lean = math.radians(15)
half = 0.1 * math.sin(lean) + 0.002 * math.cos(lean) + 1e-4
house = ("-bodies l,r -body_l_mesh box:0.002,0.06,0.1:1,4,6 -body_r_mesh box:0.002,0.06,0.1:1,4,6 -body_l_rotate 0,1,0,15 "
         f"-body_l_translate {-half},0,{0.002 * math.sin(lean) + 1e-4} -body_r_rotate 0,1,0,-15 "
         f"-body_r_translate {half - 0.002 * math.cos(lean)},0,1e-4 ")
for friction, stands in ((0.6, True), (0.05, False)):
    run(f"cards-{friction}", house + cards.format(friction) + "-ts_max_time 0.5 -probes top -probe_top_at "
        f"{-half + 0.1 * math.sin(lean)},0,{0.1 * math.cos(lean) + 0.002 * math.sin(lean) + 1e-4}")
    sunk = history(f"cards-{friction}")["top_uz"][-1]
    print(f"cards with friction {friction}: {1000 * sunk:.3g} mm")
    check((sunk > -1e-3) == stands, f"cards with friction {friction} sink by {-sunk} m")
row = ("-bodies d -body_d_mesh box:0.01,0.03,0.06:1,1,2 -body_d_copies grid:5,1,1,0.03,0,0 -body_d_translate 0,0,1e-4 -sets first -set_first_at "
       "plane:1,0,0,0 -effects gravity,ground,meet,push -effect_push_type traction -effect_push_on first -effect_push_vector 150;0;0 "
       "-effect_push_until 0.1 -probes last -probe_last_at 0.12,0,0.0601 -ts_max_time 1 ")
run("dominoes", cards.format(0.4) + row)
found = history("dominoes")
check(found["last_uz"][-1] < -0.03, f"the last domino has sunk by {-found['last_uz'][-1]} m")
check(abs(found["last_uz"][int(0.1 / 0.005)]) < 1e-3, "the last domino falls with the first one")

# a stiffness that is too low is warned of
text = run("soft", spin + box + "-body_b_rigid_stiffness 1e5 -ts_max_time 0.1")
check("rigid body 'b' is strained" in text, text)
text = run("stiff", spin + box + "-ts_max_time 0.1")
check("strained" not in text, text)
text = run("bent", box + "-bodies b -body_b_rigid yes -effects p -effect_p_type prescribed_displacement -effect_p_on b -effect_p_displacement 0.1*t*x;0;0 -ts_max_time 0.1")
check("by what prescribes its displacement" in text, text)

for options, words in (("-time euler_explicit", "-time euler_implicit"), ("-time alpha2", "-time euler_implicit"), ("-ledger", "-ledger"),
                       ("-accuracy 0.1", "-accuracy"), ("-remesh_quality 0.1", "-remesh_"), ("-effect_meet_response penalty", "barrier"),
                       ("-effect_hold_on box.zmin", "-effect_hold_on"), ("-solver pressure", "-solver pressure"),
                       ("-solver cg_p_multigrid", "-solver cg_p_multigrid"), ("-solver realtime", "-solver realtime"),
                       ("-body_box_inclusions bed", "-body_box_inclusions"), ("-body_bed_rigid_stiffness 1e5", "-body_bed_rigid_stiffness"),
                       ("-effects gravity,hold,meet,p -effect_p_type pressure -effect_p_on box.zmax -effect_p_value 3", "-effect_p_on"),
                       ("-body_box_velocity x;0;0", "-body_box_velocity"), ("-body_box_displacement 0.1*x;0;0", "-body_box_displacement"),
                       ("-effects gravity,hold,meet,f -effect_f_type contact -effect_f_obstacle plane:0,0,1,0 -effect_f_response projected",
                        "barrier"),
                       ("-displacement_view vtk:x.vtu", "-displacement_view"), ("-body_box_state nowhere", "-body_box_state"),
                       ("-contact_quality fast", "-contact_quality fast"), ("-body_box_rigid perhaps", "-body_box_rigid")):
    text = run("error", fall + "-ts_max_time 0.01 " + options, code=1)
    check("error: " in text and words in text, f"{options}: {text}")
for options in "-effect_f_response projected", "-effect_f_restitution 0.5":
    text = run("error", spin + box + "-effects f -effect_f_type contact -effect_f_obstacle plane:0,0,1,-1 " + options, code=1)
    check("error: " in text and "barrier" in text, f"{options}: {text}")
finish()
