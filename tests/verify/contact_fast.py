"""-contact_quality fast: one Newton iteration a step, in which each body goes as far as collisions let it.

Cubes that fly into each other, beside one that touches nothing: nothing passes through anything, no energy is made, momentum stays, the
lone one flies on as if nothing had happened, and the two separate as fast as with solved steps, within a fifth of what there was. A heap of
blocks falls as with solved steps, topples, and comes to rest under its weight. The same on 1, 2 and 3 ranks, and after a restart. What it is
not for is an error.
"""
import re
import shutil


from output_common import OUT
from scene_common import check, history, start

BODY = ("-body_{0}_mesh box:{1} -body_{0}_translate {2} -body_{0}_material stable_neohookean -body_{0}_young 1e5 -body_{0}_poisson 0.3 "
        "-body_{0}_density 1000 ")
FLY = ("-bodies a,b,c " + BODY.format("a", "0.1,0.1,0.1:2", "0,0,0") + BODY.format("b", "0.08,0.08,0.08:2", "0.02,0.03,0.12")
       + BODY.format("c", "0.08,0.08,0.08:2", "1,0,0") + "-body_b_rotate 1,1,0,20 -body_b_velocity 0,0,-5 -body_c_velocity 1,2,3 "
       "-effects meet -effect_meet_type contact -effect_meet_verify yes -effect_meet_friction 0.3 -ts_dt 0.002 -ts_max_time 0.06 ")
PLACES = ("0,0,0.01", "0.03,0.02,0.1", "-0.02,0.03,0.19", "0.3,0,0.06", "0.33,-0.02,0.16")
HEAP = ("-bodies a,b,c,d,e " + "".join(BODY.format(name, "0.08,0.08,0.06:2", place) for name, place in zip("abcde", PLACES))
        + "-effects gravity,floor,meet,damping -effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 -effect_floor_friction 0.4 "
        "-effect_meet_type contact -effect_meet_friction 0.4 -effect_meet_verify yes -effect_damping_alpha 3 -ts_dt 0.005 -ts_max_time 1.2 ")
COMMON = "-quiet -time euler_implicit -output_fields none -output_history_bodies yes -output_precision double -reproducible "


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def check_impact():
    run("impact-exact", FLY)
    run("impact-fast", FLY + "-contact_quality fast -ksp_rtol 1e-10")
    exact, fast = history("impact-exact"), history("impact-fast")
    start = fast["kinetic"][0]
    check((fast["newton"][1:] <= 1).all(), "impact: more than one iteration in a step")
    check(fast["total"].max() < start * 1.001, f"impact: energy {start} to {fast['total'].max()} J")
    for axis in "xyz":
        momentum = fast[f"momentum_{axis}"]
        check(abs(momentum - momentum[0]).max() < 0.01, f"impact: momentum_{axis} {momentum[0]} to {momentum}")
    lone = fast["c_centre_x"] - 1.04 - fast["time"]
    check(abs(lone).max() < 1e-8, f"impact: the body that touches nothing is {abs(lone).max()} m from its path")
    apart = [found["b_momentum_z"][-1] / 0.512 - found["a_momentum_z"][-1] for found in (exact, fast)]
    check(abs(apart[1] - apart[0]) < 1, f"impact: separates at {apart[1]} m/s, with solved steps at {apart[0]}")


def check_heap():
    run("heap-exact", HEAP)
    text = run("heap-fast", HEAP.replace("-quiet", "") + "-contact_quality fast -effect_meet_verify yes")
    exact, fast = history("heap-exact"), history("heap-fast")
    off = abs(fast["centre_z"] - exact["centre_z"])[:41].max()
    weight = 5 * 0.384 * 9.81
    check(off < 0.003, f"heap: in the first 0.2 s the centre of mass is up to {off} m off that of solved steps\n{text}")
    check(fast["kinetic"][-1] < 1e-3, f"heap: kinetic energy {fast['kinetic'][-1]} J at the end")
    check(abs(fast["floor_force_z"][-1] / weight - 1) < 0.01, f"heap: the floor bears {fast['floor_force_z'][-1]} N of {weight}")
    check(fast["total"].max() < 1e-6, f"heap: energy {fast['total'].max()} J was made")
    check(fast["newton"].sum() < 0.6 * exact["newton"].sum(), "heap: as many iterations as with solved steps")


def check_lone():
    """Beside blocks of very different stiffness that land on each other, one in free fall is late, but not slow."""
    names, young = "abcde", ("1e4", "1e5", "1e6", "1e7", "1e5")
    places = ("0,0,0.05", "0.01,0.01,0.13", "0,0.02,0.21", "0.02,0,0.29", "1,0,5")
    bodies = "".join(BODY.format(name, "0.06,0.06,0.06:2", place).replace("1e5", stiff) for name, stiff, place in zip(names, young, places))
    run("lone", "-bodies a,b,c,d,e " + bodies + "-effects gravity,floor,meet -effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 "
        "-effect_meet_type contact -ts_dt 0.0166666666 -ts_max_time 0.6 -contact_quality fast -ksp_rtol 1e-10")
    found = history("lone")
    off = abs(found["e_momentum_z"] / 0.216 + 9.81 * found["time"]).max()
    check(off < 1e-6, f"lone: the speed of a free fall is {off} m/s off")
    check(found["total"].max() < 1e-6, f"lone: energy {found['total'].max()} J was made")


def check_ranks():
    options = HEAP + "-contact_quality fast -ksp_rtol 1e-12 -ts_max_time "
    run("ranks-1", options + "0.3")
    one = history("ranks-1")
    for ranks in (2, 3):
        run(f"ranks-{ranks}", options + "0.3", ranks)
        more = history(f"ranks-{ranks}")
        for column in ("kinetic", "strain", "centre_z", "floor_force_z"):
            off = abs(more[column] - one[column]).max() / abs(one[column]).max()
            check(off < 1e-5, f"{ranks} ranks: {column} differs by {off:.3g} of its size")
    shutil.rmtree(OUT / "ranks-half", ignore_errors=True)
    run("ranks-half", options + "0.15 -checkpoint_every_steps 10")
    run("ranks-half", options + "0.3 -checkpoint_every_steps 10 -restart latest")
    half = history("ranks-half")
    check(abs(half["kinetic"] - one["kinetic"]).max() < 1e-12, "restart: kinetic energy differs")


def check_refusals():
    for options, words in (("-effect_meet_response projected", "has multipliers"), ("-effect_meet_restitution 0.5", "restitution"),
                           ("-time newmark", "the integrator here"), ("-effects damping -effect_damping_alpha 1", "no effect here")):
        base = FLY if "damping" not in options else FLY[:FLY.index("-effects")] + "-ts_dt 0.002 -ts_max_time 0.06 "
        text = run("refused", base + options + " -contact_quality fast", code=1)
        check(re.search("contact_quality fast is for .*" + words, text), f"{options}: {text}")


check_impact()
check_heap()
check_lone()
check_ranks()
check_refusals()
