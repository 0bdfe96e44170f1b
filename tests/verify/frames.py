"""The effect frame: inertia in a frame that accelerates and turns.

A frame that rises with g doubles the weight. A bar that turns about its end is longer by rho w^2 L^3 / (3 E). A body at rest in a turning frame that nothing
holds flies off along a straight line, as seen from outside, also while the frame turns faster and faster, with rigid and soft bodies, on 1 and 3 ranks.
"""
import numpy

from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def last(folder):
    return {name: values[-1] for name, values in history(folder).items()}


CUBE = "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_density 1000 "
SOFT = "-body_a_material linear -body_a_young 1e6 -body_a_poisson 0.3 "
for element in ("p1", "p2", "cr"):
    run("lift", CUBE + SOFT + f"-body_a_element {element} -effects gravity,lift,hold -effect_lift_type frame -effect_lift_acceleration 0;0;9.81 -effect_hold_type fixed -effect_hold_on zmin -time static")
    near(last("lift")["hold_reaction_z"], 2 * 9.81, 1e-6, f"{element}: weight in a lift, N")

BAR = ("-bodies a -body_a_mesh box:1,0.1,0.1:20,2,2 -body_a_material linear -body_a_young 1e6 -body_a_poisson 0 -body_a_density 1000 -effects hold,y,z,spin -effect_hold_type fixed "
       "-effect_hold_on xmin -effect_y_type fixed -effect_y_on ymin -effect_y_components y -effect_z_type fixed -effect_z_on zmin -effect_z_components z -effect_spin_type frame "
       "-effect_spin_speed 1 -probes tip -probe_tip_at 1,0,0 -time static ")
run("centrifuge", BAR + "-body_a_element p2")
near(last("centrifuge")["tip_ux"], 1000 / 3e6, 2e-6, "turning bar: longer by, m")

# released at x = 1 in a frame that turns about z: outside it flies with v = w x r, and the frame has turned by the integral of w
for name, body in (("soft", SOFT.replace("linear", "corotated")), ("rigid", "-body_a_rigid yes ")):
    for ranks in (1, 3):
        for speed, turned, first in (("3", 3 * 0.4, 3.0), ("3+5*t", 3 * 0.4 + 2.5 * 0.16, 3.0)):
            off = []
            for step in (4e-3, 2e-3):
                run("fly", CUBE + body + f"-body_a_translate 0.95,-0.05,-0.05 -effects spin -effect_spin_type frame -effect_spin_speed {speed} -time newmark -ts_dt {step} -ts_max_time 0.4", ranks)
                end = last("fly")
                outside = numpy.array([1, first * 0.4])
                c, s = numpy.cos(turned), numpy.sin(turned)
                there = numpy.array([[c, s], [-s, c]]) @ outside
                off.append(numpy.hypot(end["centre_x"] - there[0], end["centre_y"] - there[1]))
            what = f"{name}, {ranks} ranks, speed {speed}"
            near(off[1], 0, 2e-4, f"{what}: place seen from the frame, m off")
            near(off[0] / off[1], 4, 0.8, f"{what}: over that with half the step")
check(history("fly")["newton"].max() <= 8, f"{history('fly')['newton'].max()} iterations")

for options, words in ((CUBE + SOFT + "-effects spin -effect_spin_type frame ", "-effect_spin_speed"), (CUBE + SOFT + "-effects spin -effect_spin_type frame -effect_spin_speed 1 -effect_spin_axis 0,0,0 ", "-effect_spin_axis")):
    text = run("error", options, code=1)
    check(words in text, f"{words}: {text}")
finish()
