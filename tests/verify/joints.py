"""The effect joint: ball, hinge, slider, weld between bodies, rigid and soft, and the ground.

A pendulum and a double pendulum of rigid rods swing as their equations of motion have it, of second order in the step. Motors by angle and by torque, sliders by
way and by force, springs and limits do what they are given. Two bodies that spin around a common hinge keep momenta and energy. A soft bar that is welded to the
ground bends as a clamped one; a soft and a rigid body are the same on 1 and 3 ranks, and after a restart. What is no joint is an error.
"""
import numpy

from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "
ROD = "-body_{0}_mesh box:0.2,0.02,0.02:1 -body_{0}_rigid yes -body_{0}_density 1000 -body_{0}_translate {1} "
MASS, LENGTH, G = 0.08, 0.2, 9.81
MIDDLE = MASS * (LENGTH**2 + 0.02**2) / 12  # moment of inertia about the middle, kg m^2
END = MIDDLE + MASS * LENGTH**2 / 4
HIP = "-effect_hip_type joint -effect_hip_on a -effect_hip_at 0,0,0 -effect_hip_kind hinge -effect_hip_axis 0,1,0 "


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def last(folder):
    return {name: values[-1] for name, values in history(folder).items()}


def integrate(rate, y, end, steps=4000):
    """Runge and Kutta's fourth order, for the references."""
    h = end / steps
    y = numpy.array(y, float)
    for _ in range(steps):
        k1 = rate(y)
        k2 = rate(y + h / 2 * k1)
        k3 = rate(y + h / 2 * k2)
        k4 = rate(y + h * k3)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return y


# a rod falls from the horizontal: I theta'' = m g L / 2 cos(theta)
ONE = "-bodies a " + ROD.format("a", "0,-0.01,-0.01") + "-effects gravity,hip " + HIP + "-time newmark -ts_max_time 0.4 "
exact = integrate(lambda y: numpy.array([y[1], MASS * G * LENGTH / 2 * numpy.cos(y[0]) / END]), [0, 0], 0.4)
off = []
for step in (8e-3, 4e-3):
    run("pendulum", ONE + f"-ts_dt {step}")
    off.append(last("pendulum")["hip_angle"] - numpy.degrees(exact[0]))
near(off[1], 0, 0.05, "pendulum: angle, degrees, off")
near(off[0] / off[1], 4, 0.7, "its error, over that with half the step")
pendulum = history("pendulum")
check(pendulum["hip_gap"].max() < 1e-5 * LENGTH and pendulum["newton"].max() <= 4, f"pendulum: gap {pendulum['hip_gap'].max()} m, {pendulum['newton'].max()} iterations")
run("pendulum", ONE.replace("newmark", "genalpha") + "-ts_dt 2e-3 -ts_max_time 0.3")
pendulum = history("pendulum")
turned = pendulum["hip_angle"][-1] * numpy.pi / 180
speed2 = MASS * G * LENGTH * numpy.sin(turned) / END
near(pendulum["hip_force_z"][-1], MASS * (G + LENGTH / 2 * (speed2 * numpy.sin(turned) - MASS * G * LENGTH / 2 * numpy.cos(turned) ** 2 / END)), 5e-3, "pendulum: upward force, N")

# a second rod hangs from the first one, by a hinge or a ball
TWO = ("-bodies a,b " + ROD.format("a", "0,-0.01,-0.01") + ROD.format("b", "0.2,-0.01,-0.01") + "-effects gravity,hip,knee " + HIP
       + "-effect_knee_type joint -effect_knee_on b -effect_knee_to a -effect_knee_at 0.2,0,0 -time newmark -ts_max_time 0.3 -ts_dt 1e-3 ")


def double(y):
    """Angles below the horizontal and their rates, of two rods."""
    difference = y[0] - y[1]
    moment = MASS * LENGTH**2 / 2
    matrix = [[MIDDLE + 2.5 * moment, moment * numpy.cos(difference)], [moment * numpy.cos(difference), MIDDLE + moment / 2]]
    turning = moment * numpy.sin(difference)
    weight = MASS * G * LENGTH / 2
    force = [3 * weight * numpy.cos(y[0]) - turning * y[3] ** 2, weight * numpy.cos(y[1]) + turning * y[2] ** 2]
    return numpy.concatenate([y[2:], numpy.linalg.solve(matrix, force)])


exact = numpy.degrees(integrate(double, [0, 0, 0, 0], 0.3))
for kind in ("hinge -effect_knee_axis 0,1,0", "ball"):
    run("double", TWO + f"-effect_knee_kind {kind}", 2)
    near(last("double")["hip_angle"], exact[0], 0.05, f"double pendulum, {kind}: angle of the first rod")
    if kind != "ball":
        near(last("double")["knee_angle"], exact[1] - exact[0], 0.1, "of the second one to it")

# motors: an angle that grows with t^2 takes the torque I w', a given torque gives the angle T t^2 / (2 I)
SPIN = "-bodies a " + ROD.format("a", "0,-0.01,-0.01") + "-effects hip " + HIP + "-ts_max_time 0.5 -ts_dt 0.005 "
run("motor", SPIN + "-effect_hip_angle 2000*t^2 -time newmark -ts_dt 1e-3")
rate = 2 * numpy.radians(2000)
near(history("motor")["hip_torque_y"][-200:].mean(), END * rate, 0.01 * END * rate, "motor by angle: mean torque, N m")
near(last("motor")["kinetic"] / last("motor")["load_work"], 1, 2e-3, "its work over the kinetic energy")
near(last("motor")["hip_angle"], 2000 * 0.25, 0.05, "its angle, degrees, turned more than once")

run("driven", SPIN + "-effect_hip_torque 0.01 -time newmark -ts_max_time 0.2")
near(last("driven")["hip_angle"], numpy.degrees(0.01 * 0.04 / (2 * END)), 0.02, "motor by torque: angle, degrees")

# statics of a spring: k theta = m g L / 2 cos(theta)
run("spring", ONE.replace("-time newmark", "-time static -static_steps 4") + "-effect_hip_spring 0.2")
angle = numpy.radians(last("spring")["hip_angle"])
near(0.2 * angle, MASS * G * LENGTH / 2 * numpy.cos(angle), 1e-5, "static spring: moment, N m")

# limits: it falls to 30 degrees and stays, with a damper
run("limit", ONE.replace("newmark", "euler_implicit") + "-effect_hip_limits -90,30 -effect_hip_damping 0.002 -ts_dt 0.005 -ts_max_time 1")
near(last("limit")["hip_angle"], 30, 0.02, "limit: angle, degrees")

# beyond half a turn: a spring draws back all the way, a stop is where it is, and a run that goes on knows
run("whole", SPIN + "-effect_hip_spring 0.1 -effects hip,more -effect_more_type joint -effect_more_on a -effect_more_at 0,0,0 -effect_more_axis 0,1,0 -effect_more_angle 300*t "
    "-time static -static_steps 20")
near(last("whole")["more_torque_y"], 0.1 * numpy.radians(300), 1e-5, "motor against a spring at 300 degrees: torque, N m")
TURN = SPIN + "-effect_hip_torque 0.02 -effect_hip_damping 0.005 -effect_hip_limits -90,400 -ts_max_time 3 -checkpoint_every_time 1.5 "
run("stop", TURN)
near(last("stop")["hip_angle"], 400, 0.05, "stop at 400 degrees: angle")
run("stop-on", TURN + "-ts_max_time 1.5")
run("stop-on", TURN + "-restart latest", 2)
near(last("stop-on")["hip_angle"], last("stop")["hip_angle"], 1e-5, "restart beyond half a turn: angle, degrees")

# sliders: down a slope of 30 degrees by g t^2 / 2 sin; by a force against a spring; by a motor
SLOPE = ("-bodies a " + ROD.format("a", "0,-0.01,-0.01") + "-effects gravity,rail -effect_rail_type joint -effect_rail_on a -effect_rail_kind slider "
         "-effect_rail_at 0.1,0,0 -effect_rail_axis 0.8660254037844387,0,-0.5 ")
run("slope", SLOPE + "-time newmark -ts_dt 0.005 -ts_max_time 0.2")
near(last("slope")["rail_displacement"], G / 4 * 0.04, 1e-4, "slider on a slope: way, m")
near(history("slope")["rail_force_x"][1:].mean(), MASS * G * 0.5 * 0.8660254037844387, 0.02, "its mean force, N")
run("slider", SLOPE + "-effects rail -effect_rail_force 2 -effect_rail_spring 40 -time static")
near(last("slider")["rail_displacement"], 0.05, 1e-6, "slider with a spring: way, m")
run("slider", SLOPE + "-effect_rail_displacement 0.03 -time static")
near(last("slider")["rail_displacement"], 0.03, 1e-5, "slider by a motor: way, m")
near(last("slider")["rail_force_z"], MASS * G, 1e-6, "its upward force, N")
near(last("slider")["rail_torque_y"], 0, 1e-7, "its moment about the middle, N m")

# two bodies on a common hinge spin freely: momenta, energy; in any orientation, with a spring
FREE = ("-bodies a,b " + ROD.format("a", "0,-0.01,-0.01") + ROD.format("b", "0.2,-0.01,-0.01") + "-body_a_angular_velocity 3,2,5 -body_b_angular_velocity 3,6,9 "
        "-body_a_velocity -0.5,0.5,0 -body_b_velocity -0.5,1.9,-0.8 -effects knee -effect_knee_type joint -effect_knee_on b -effect_knee_to a -effect_knee_at 0.2,0,0 "
        "-effect_knee_axis 0,1,1 -effect_knee_spring 0.01 -time newmark -ts_dt 1e-3 -ts_max_time 0.2 ")
run("free", FREE)
free = history("free")
total = free["kinetic"] + free["strain"] + free["knee_energy"]
near(abs(total / total[0] - 1).max(), 0, 2e-3, "free hinge: energy")
for name in ("momentum_x", "momentum_z"):
    near(abs(free[name] - free[name][0]).max(), 0, 1e-9, f"free hinge: {name}")
for name in ("angular_x", "angular_y", "angular_z"):
    near(abs(free[name] - free[name][0]).max(), 0, 1e-5 * abs(free["angular_z"][0]), f"free hinge: {name}")
check(abs(free["knee_angle"]).max() > 5, f"free hinge: it turns by {abs(free['knee_angle']).max()} degrees")

# a soft bar, welded to the ground by its end, and clamped there
BAR = ("-bodies a -body_a_mesh box:0.4,0.1,0.1:4 -body_a_element p2 -body_a_material linear -body_a_young 1e6 -body_a_poisson 0.3 -body_a_density 1000 -sets end "
       "-set_end_at box:-1,-1,-1,0.051,1,1 -effect_clamp_on end -time static ")
run("bar", BAR + "-effects gravity,clamp -effect_clamp_type fixed")
clamped = last("bar")["strain"]
run("bar", BAR + "-effects gravity,clamp -effect_clamp_type joint -effect_clamp_kind weld -effect_clamp_at 0.025,0.05,0.05")
# its end may strain: it is as long as from the edge of the set or from its middle, 0.35 to 0.375 m, to the 5th power
near(last("bar")["strain"] / clamped, 1.2, 0.2, "welded bar: energy, over that of a clamped one")
near(last("bar")["clamp_force_z"], 4 * G, 1e-6, "its upward force, N")
near(last("bar")["clamp_torque_y"], -4 * G * 0.175, 5e-3, "its moment about the joint, N m")

# a rigid arm on a soft one: ranks, and a restart
MIXED = ("-bodies a,b " + ROD.format("b", "0.2,-0.01,-0.01") + "-body_a_mesh box:0.2,0.02,0.02:2 -body_a_translate 0,-0.01,-0.01 -body_a_material corotated -body_a_young 1e6 "
         "-body_a_poisson 0.3 -body_a_density 1000 -sets root -set_root_at plane:1,0,0,0 -effects gravity,clamp,knee -effect_clamp_type fixed "
         "-effect_clamp_on root -effect_knee_type joint -effect_knee_on b -effect_knee_to a -effect_knee_radius 0.03 -effect_knee_at 0.2,0,0 -effect_knee_axis 0,1,0 -effect_knee_limits -40,40 "
         "-ts_dt 0.005 -checkpoint_every_time 0.05 ")
run("mixed", MIXED + "-ts_max_time 0.1")
mixed = history("mixed")
run("mixed-3", MIXED + "-ts_max_time 0.1", 3)
for name in ("knee_angle", "knee_force_z", "strain"):
    near(history("mixed-3")[name][-1], mixed[name][-1], 1e-7 * abs(mixed[name]).max(), f"1 and 3 ranks: {name}")
run("mixed-on", MIXED + "-ts_max_time 0.05")
run("mixed-on", MIXED + "-ts_max_time 0.1 -restart latest", 2)
near(last("mixed-on")["knee_angle"], mixed["knee_angle"][-1], 1e-7 * abs(mixed["knee_angle"]).max(), "restart: angle, degrees")
check(mixed["newton"].max() <= 8, f"{mixed['newton'].max()} iterations")

FLAT = BAR.replace("box:-1,-1,-1,0.051,1,1", "plane:1,0,0,0") + "-effects gravity,clamp -effect_clamp_type joint -effect_clamp_at 0,0,0 "
ERRORS = ((SPIN.replace("-effect_hip_axis 0,1,0", ""), "-effect_hip_axis"), (SPIN.replace("-effect_hip_kind hinge -effect_hip_axis 0,1,0", "-effect_hip_kind ball") + "-effect_hip_angle 1 ", "-effect_hip_angle"),
          (FLAT + "-effect_clamp_kind weld ", "in a plane"), (BAR + "-effects gravity,clamp -effect_clamp_type joint -effect_clamp_at 0,0,0 -effect_clamp_kind weld -effect_clamp_radius 1e-3 ", "four or more"), (SPIN + "-effect_hip_to a ", "of one body"), (SPIN + "-effect_hip_limits 10,20 ", "-effect_hip_limits"), (SPIN + "-effect_hip_limits -10,10 -effect_hip_angle t ", "-effect_hip_limits"), (SPIN + "-effect_hip_torque 1 -effect_hip_angle t ", "-effect_hip_torque"),
          (TWO.replace("-time newmark", "-time static").replace("gravity,", "") + "-effect_knee_kind weld -effects hip,knee,push -effect_push_type body_force -effect_push_density 0;0;100 ",
           "join to it"),
          (TWO.replace("-effect_knee_on b -effect_knee_to a", "-effect_knee_on a,b") + "-effect_knee_kind ball ", "two bodies"), (BAR.replace("static", "euler_explicit") + "-effects gravity,clamp -effect_clamp_type joint -effect_clamp_kind weld -effect_clamp_at 0,0,0 ", "clamp"), (SPIN + "-effect_hip_displacement 1 ", "-effect_hip_displacement"))
for options, words in ERRORS:
    text = run("error", options, code=1)
    check(words in text, f"{words}: {text}")
text = run("far", SPIN + "-effect_hip_at 5,0,0 -ts_max_time 0.005 ")
check("warning" in text and "away from" in text, text)
for options, words in ((ONE + "-effect_hip_limits -1,1 -ts_max_time 0.01 ", "makes energy"), (SPIN + "-effects hip,hold -effect_hold_type fixed -effect_hold_on a -ts_max_time 0.005 ", "supports hold all"),
                       (TWO.replace('0.2,-0.01', '0.19,-0.01') + "-effect_knee_kind ball -ts_max_time 0.005 ", "")):
    text = run("said", options)
    check(words in text if words else "warning" not in text, f"{words or 'no warning'}: {text}")
finish()
