"""Friction of all responses between bodies: what sticks does not creep, what slides has Coulomb's acceleration.

A block on a slope of 30 degrees, tan 0.577, in time and static: it rests with a coefficient of 0.7 and slides with 0.5. Smoothed
friction creeps by 1e-4 m/s there. Under a millionth of the weight as well. At rest a step takes one Newton iteration, and nothing moves by 1e-9 m in 100 s. The same on 1, 2 and 3 ranks to 1e-7 of its path, and after restarts while it sticks and slides.
"""
import csv
import math
import subprocess
import sys

import numpy

from output_common import MPI, OUT, SUPPLE

BLOCKS = ("-bodies a,b -body_a_mesh box:0.4,0.2,0.05:6,3,1 -body_b_mesh box:0.1,0.1,0.05:3,3,2 -body_b_translate 0.05,0.05,0.05015 "
          + "".join(f"-body_{k}_material stable_neohookean -body_{k}_young 1e6 -body_{k}_poisson 0.3 -body_{k}_density 1000 " for k in "ab")
          + "-effects g,hold,meet -effect_g_type gravity -effect_g_vector 4.905,0,-8.4957 -effect_hold_type fixed -effect_hold_on a.zmin "
          "-effect_meet_type contact -effect_meet_verify yes -output_fields none -probes p -probe_p_on b -quiet -reproducible ")
PLANE = ("-bodies b -body_b_mesh box:0.1,0.1,0.05:3,3,2 -body_b_translate 0.05,0.05,0.00015 -body_b_material stable_neohookean -body_b_young 1e6 "
         "-body_b_poisson 0.3 -body_b_density 1000 -effects g,meet -effect_g_type gravity -effect_meet_type contact "
         "-effect_meet_obstacle plane:0,0,1,0 -output_fields none -probes p -probe_p_on b -quiet -reproducible ")
GRIP = ("-bodies b,l,r -body_b_mesh box:0.05,0.05,0.05:3 -body_b_young 5e4 -body_l_mesh box:0.02,0.04,0.06:2,3,4 -body_l_translate -0.0205,0.005,-0.005 "
        "-body_r_mesh box:0.02,0.04,0.06:2,3,4 -body_r_translate 0.0505,0.005,-0.005 -body_l_young 2e7 -body_r_young 2e7 "
        + "".join(f"-body_{k}_material stable_neohookean -body_{k}_poisson 0.4 -body_{k}_density 1000 " for k in "blr")
        + "-effects g,l,r,meet -effect_g_type gravity -effect_l_type prescribed_displacement -effect_l_on l.xmin "
        "-effect_l_displacement 0.004*ramp(t/0.3);0;0 -effect_r_type prescribed_displacement -effect_r_on r.xmax "
        "-effect_r_displacement -0.004*ramp(t/0.3);0;0 -effect_meet_type contact -output_fields none -probes p -probe_p_on b -quiet -reproducible ")
STEPS = "-time euler_implicit -ts_dt 0.005 "
TIGHT = "-snes_rtol 1e-10 -snes_stol 0 -ksp_rtol 1e-10 -effect_meet_multiplier_tolerance 1e-9 "
G = (4.905, 8.4957)  # along the slope and into it, m/s^2


def run(name, response, friction, more, ranks=1, code=0, base=BLOCKS):
    command = [*MPI, str(ranks), SUPPLE, *(base + more).split(), "-effect_meet_response", response,
               "-effect_meet_friction", str(friction), "-output_dir", str(OUT / name)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode != code:
        sys.exit(f"{name}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    if code:
        return None, result.stdout + result.stderr
    with open(OUT / name / "history.csv", newline="") as f:
        names, _, *rows = csv.reader(f)
    found = {key: numpy.array([float(row[k]) for row in rows]) for k, key in enumerate(names)}
    return found, result.stdout + result.stderr


def speed(found, steps=20):
    return (found["p_ux"][-1] - found["p_ux"][-1 - steps]) / (found["time"][-1] - found["time"][-1 - steps])


def check(good, text):
    if not good:
        sys.exit(text)


def check_time():
    for response, creep in ("projected", 1e-8), ("multiplier", 1e-8), ("augmented", 5e-8), ("barrier", 1e-9), ("penalty", 1e-9):
        found, _ = run(f"stick-{response}", response, 0.7, STEPS + "-ts_max_time 0.5")
        v = speed(found)
        print(f"  stick-{response}: {v:.1e} m/s, {sum(found['newton']):.0f} Newton iterations")
        check(abs(v) < creep, f"stick-{response}: it creeps by {v:.3g} m/s")
        if response in ("barrier", "penalty"):
            check(sum(found["newton"][-50:]) <= 50, f"stick-{response}: {sum(found['newton'][-50:])} iterations in 50 steps at rest")

        found, _ = run(f"slide-{response}", response, 0.5, STEPS + "-ts_max_time 0.3")
        # over 20 steps, by the backward differences of implicit Euler
        exact = (G[0] - 0.5 * G[1]) * (found["time"][-1] - 0.0475)
        v = speed(found)
        print(f"  slide-{response}: {v:.5f} m/s, of a rigid block {exact:.5f}")
        check(abs(v / exact - 1) < (0.01 if response in ("projected", "multiplier") else 0.03), f"slide-{response}: speed {v:.5f} m/s, not {exact:.5f}")
        ratio = found["meet_friction_force"][-1] / found["meet_normal_force"][-1]
        # of augmented the normal force of the update before, within its tolerance
        check(abs(ratio / 0.5 - 1) < (3e-3 if response == "augmented" else 1e-3), f"slide-{response}: friction is {ratio:.5f} of the normal force, not 0.5")
        check((numpy.diff(found["meet_friction_loss"]) >= 0).all(), f"slide-{response}: friction gives energy back")


def check_light():
    """Under a millionth of gravity: the forces are those of the weight, nothing creeps, no step gains energy."""
    for response in "projected", "multiplier", "augmented", "penalty":
        found, text = run(f"light-{response}", response, 0.7, STEPS + "-ts_max_time 0.15 -effect_g_vector 4.905e-6,0,-8.4957e-6")
        weight = 1000 * 0.1 * 0.1 * 0.05 * G[1] * 1e-6
        off = abs(found["meet_normal_force"][-15:] / weight - 1).max()
        creep = abs(speed(found, 15)) / (G[0] * 1e-6 * 0.15)
        gain = numpy.diff(found["total"]).max() / (weight * 0.05)
        print(f"  light-{response}: force {off:.1e} off, creep {creep:.1e} of free fall, {sum(found['newton']):.0f} Newton iterations")
        check(off < 5e-3, f"light-{response}: the normal force is {off:.3g} of the weight off")
        check(creep < 1e-6, f"light-{response}: it creeps by {creep:.3g} of its free fall")
        check(gain < 1e-12 and "warning" not in text, f"light-{response}: energy rises by {gain:.3g} of the weight times 5 cm\n{text}")


def check_stiff():
    """Bodies of 1 GPa, in which a small slip has a large force: friction keeps Coulomb's law from the first step on."""
    stiff = "-body_a_young 1e9 -body_b_young 1e9 -body_b_translate 0.05,0.05,0.05 "
    for response in "projected", "multiplier", "augmented", "barrier", "penalty":
        for name, more in ("static", "-time static -static_steps 1 "), ("moves", STEPS + "-ts_max_steps 6 -ts_max_time 0.03 "):
            found, _ = run(f"stiff-{name}-{response}", response, 0.7 if name == "static" else 0.5, stiff + more)
            ratio = found["meet_friction_force"][1:] / found["meet_normal_force"][1:]
            print(f"  stiff-{name}-{response}: friction over the normal force {ratio.min():.4f} to {ratio.max():.4f}")
            over = 1.06 if response == "augmented" else 1.03  # its normal force is of the solution before
            check(ratio.max() < (0.7 if name == "static" else 0.5) * over, f"stiff-{name}-{response}: friction is {ratio.max():.4f} of the normal force")


def check_loss():
    """What the springs of sticking pairs store is no loss: with a coefficient of a million, a block with a speed stops, swings and is at rest."""
    for response in "projected", "augmented", "barrier", "penalty":
        for friction in 0.7, 1e6:
            found, _ = run(f"loss-{response}", response, friction, STEPS + "-ts_max_time 0.15" + (" -body_b_velocity 0.3,0,0" if friction > 1 else ""))
            loss = found["meet_friction_loss"]
            check(loss.max() > 0 and numpy.diff(loss).min() >= -1e-12 * loss.max(),
                  f"loss-{response}, {friction}: the loss of {loss.max():.3g} J falls by {-numpy.diff(loss).min():.3g} J")


def check_smooth():
    """The smoothed friction that creeps is there as well, below the speed that is given."""
    found, _ = run("smooth", "barrier", 0.7, STEPS + "-ts_max_time 0.2 -effect_meet_sticking smooth")
    check(1e-6 < speed(found) < 1e-3, f"smooth: speed {speed(found):.3g} m/s")
    for slip in 1e-3, 1e-5:
        found, _ = run(f"smooth-{slip}", "barrier", 0.7, STEPS + f"-ts_max_time 0.3 -effect_meet_sticking smooth -effect_meet_slip_speed {slip}")
        v = speed(found)
        print(f"  smooth, slip speed {slip} m/s: {v:.2e} m/s")
        check(0.2 * slip < v < slip, f"smooth-{slip}: speed {v:.3g} m/s")
    _, text = run("smooth-error", "barrier", 0.7, STEPS + "-effect_meet_slip_speed 1e-3", code=1)
    check("-effect_meet_slip_speed" in text, f"smooth-error: {text}")

    # a slip in a step that positions cannot hold, or as long as a body
    for slip in ("1e-30", "1e3"):
        _, text = run(f"smooth-{slip}", "barrier", 0.7, STEPS + f"-effect_meet_sticking smooth -effect_meet_slip_speed {slip}", code=1)
        check("-effect_meet_slip_speed" in text and "smallest body" in text, f"smooth-{slip}: {text}")


def check_hold():
    """What sticks stays for 100 s: blocks on half-spaces of 30 and 44 degrees and on a slope with a coefficient of 1, and one in a grip."""
    for angle in 30, 44:
        slope = f"-effect_g_vector {9.81 * math.sin(math.radians(angle))},0,{-9.81 * math.cos(math.radians(angle))} "
        more = "-time euler_implicit -ts_dt 0.01 -ts_max_time 100 " + slope
        held = "-time euler_implicit -ts_dt 0.01 -ts_max_time 100 "
        scenes = [(f"hold-plane-{angle}", PLANE, more)]
        if angle == 44:
            scenes += [("hold-44", BLOCKS, more), ("hold-grip", GRIP, held)]
        for name, base, options in scenes:
            found, _ = run(name, "barrier", 0.5 if base == GRIP else 1, options, base=base)
            rest = found["time"] >= 3
            drift = max(abs(found[key][rest] - found[key][rest][0]).max() for key in ("p_ux", "p_uy", "p_uz"))
            print(f"  {name}: moves by {drift:.1e} m in {found['time'][-1] - 3:.0f} s")
            check(found["time"][-1] > 99.9 and found["meet_contacts"][-1] > 0, f"{name}: ends at {found['time'][-1]} s")
            check(drift < 1e-9, f"{name}: it moves by {drift:.3g} m")


def check_static():
    """Held by friction alone: the force into and along the slope is the weight; beyond Coulomb's limit nothing holds."""
    for response in "projected", "multiplier", "augmented", "barrier", "penalty":
        for gap in "1", "1.5":  # 1e-4 m; the latter is the width
            found, _ = run(f"static-{response}", response, 0.7, f"-time static -body_b_translate 0.05,0.05,0.050{gap.replace('.', '')}")
            for axis, g in (("x", G[0]), ("z", -G[1])):
                reaction = found[f"hold_reaction_{axis}"][-1]
                weight = 1000 * (0.4 * 0.2 * 0.05 + 0.1 * 0.1 * 0.05) * g
                check(abs(abs(reaction / weight) - 1) < 1e-6, f"static-{response}, gap {gap}e-4 m: reaction {reaction} N for {weight} N")
    _, text = run("static-slides", "projected", 0.5, "-time static", code=1)
    check("body b against moving along" in text, f"static-slides: not said what slides\n{text}")


def compare(name, one, other, tolerance):
    for column in "p_ux", "p_uz", "meet_normal_force", "meet_friction_loss":
        size = max(abs(one[column]).max(), 1e-7)
        off = abs(one[column] - other[column][-len(one[column]):]).max() / size
        check(off < tolerance, f"{name}: {column} differs by {off:.3g} of its size")


def check_ranks():
    for friction in 0.7, 0.5:
        options = STEPS + TIGHT + "-ts_max_time 0.1"
        one, _ = run(f"ranks-{friction}-1", "projected", friction, options)
        for ranks in 2, 3:
            other, _ = run(f"ranks-{friction}-{ranks}", "projected", friction, options, ranks)
            compare(f"ranks-{friction}-{ranks}", one, other, 1e-6 if friction > 0.6 else 1e-7)


def check_restart():
    for friction in 0.7, 0.5:
        options = STEPS + TIGHT + "-checkpoint_every_steps 10 -ts_max_time "
        whole, _ = run(f"whole-{friction}", "projected", friction, options + "0.1")
        run(f"half-{friction}", "projected", friction, options + "0.05")
        half, _ = run(f"half-{friction}", "projected", friction, options + "0.1 -restart latest", 2)
        compare(f"restart-{friction}", whole, half, 1e-6 if friction > 0.6 else 1e-7)


check_time()
check_light()
check_stiff()
check_loss()
check_smooth()
check_hold()
check_static()
check_ranks()
check_restart()
