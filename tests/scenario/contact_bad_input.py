"""Invalid scenes with each of the five responses, of bodies with each other and with obstacles: an error or a warning that names what is
wrong, or the correct motion.

Bodies that overlap, that are in the same place, that touch, also where both are held; a thin body and a thin obstacle that are hit by more than their thickness in a
step; an obstacle with an open surface; one that jumps over a body. Two effects for the same surfaces, which would double forces, are refused;
different surfaces of the same bodies are not.
@ranks 1 2
@cpu 120
"""
import csv
import os
import subprocess
import sys
from pathlib import Path

SUPPLE, OUT = os.environ["SB_SUPPLE"], Path(os.environ["SB_OUT"])
MPI = [*os.environ["SB_MPI"].split(), os.environ["SB_RANKS"]]
ALL = ("barrier", "projected", "multiplier", "augmented", "penalty")
BODY = ("-body_{0}_mesh box:{1} -body_{0}_translate {2} -body_{0}_material stable_neohookean -body_{0}_young 1e5 -body_{0}_poisson 0.3 "
        "-body_{0}_density 1000 ")
TIME = "-time euler_implicit -ts_dt 0.01 -ts_max_time 0.05 "
A = BODY.format("a", "0.1,0.1,0.1:2", "0,0,0")
TWO = "-bodies a,b " + A + TIME + "-effects hold,meet -effect_hold_type fixed -effect_hold_on a.zmin -effect_meet_type contact -effect_meet_verify yes "
ONE = "-bodies a " + A + TIME + "-effects hold,meet -effect_hold_type fixed -effect_hold_on a.zmin -effect_meet_type contact "
FREE = "-bodies a " + A + TIME + "-body_a_velocity 0,0,20 -effects meet -effect_meet_type contact "
PLATE = "-effect_meet_obstacle box:-0.1,-0.1,{0},0.2,0.2,{1} "
passed = failed = 0


def check(name, good, text):
    global passed, failed
    passed, failed = passed + bool(good), failed + (not good)
    if not good:
        print(f"FAILED {name}: {text}")


def run(name, options, response):
    """Exit code, messages, and the last row of the history."""
    out = OUT / f"{name}-{response}"
    result = subprocess.run([*MPI, SUPPLE, *options.split(), "-effect_meet_response", response, "-output_fields", "none", "-quiet",
                             "-output_dir", str(out)], capture_output=True, text=True, check=False)
    last = {}
    if (out / "history.csv").exists():
        with open(out / "history.csv", newline="") as f:
            names, _, *rows = csv.reader(f)
        last = dict(zip(names, map(float, rows[-1]))) if rows else {}
    return result.returncode, result.stdout + result.stderr, last


(OUT / "open.off").write_text("OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 -1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n")
for response in ALL:
    nodes = response != "barrier"  # with an obstacle these are of nodes, which are tested at the ends of steps

    code, text, last = run("overlap", TWO + BODY.format("b", "0.1,0.1,0.1:2", "0.02,0.01,0.09"), response)
    check(f"overlap {response}", code == 0 and "a and b overlap" in text and last["meet_penetration"] < 0.01, text)
    code, text, _ = run("same", TWO + BODY.format("b", "0.1,0.1,0.1:2", "0,0,0"), response)
    check(f"same {response}", code == 1 and "error: " in text and "body a" in text and "same place" in text, text)
    code, text, last = run("touch", TWO + BODY.format("b", "0.1,0.1,0.1:2", "0,0,0.1"), response)
    check(f"touch {response}", code == 0 and not text.strip() and last["kinetic"] < 1e-6, text)
    held = TWO.replace("hold_on a.zmin", "hold_on a.zmin,b.zmin") + BODY.format("b", "0.1,0.1,0.1:2", "0.09999,0,0")
    code, text, last = run("held", held, response)
    bounded = last and last["strain"] + last["kinetic"] < 0.1  # J; their stiffness times their volume is 100 J
    check(f"held {response}", bounded if code == 0 else "error: " in text, f"{last.get('strain')} J {text}")
    thin = (TWO.replace("0.05 ", "0.02 ") + BODY.format("b", "0.3,0.3,0.002:2,2,1", "-0.1,-0.1,0.11")).replace("hold_on a.zmin", "hold_on b.xmin,b.xmax")
    code, text, last = run("plate", thin + "-body_a_velocity 0,0,2", response)
    check(f"plate {response}", code == 0 and last["meet_contacts"] > 0, text)

    code, text, _ = run("open", ONE + f"-effect_meet_obstacle mesh:{OUT / 'open.off'}", response)
    check(f"open {response}", code == 1 and "open.off" in text and "the surface is open" in text, text)
    code, text, last = run("inside", ONE + PLATE.format(0.09, 0.13), response)
    check(f"inside {response}", code == 0 and last["inverted"] == 0 and 0.005 < last["meet_penetration"] < 0.01, text)
    code, text, last = run("thin", FREE + PLATE.format(0.13, 0.1301), response)
    said = "effect meet" in text and "passed through the obstacle" in text and "response barrier" in text
    fast = text.count("warning") == 1 and "a would go 0.2 m in a step" in text
    check(f"thin {response}", code == 0 and (said if nodes else fast and last["centre_z"] < 0.13), text)
    code, text, last = run("jump", ONE + PLATE.format(0.11, 0.13) + "-effect_meet_displacement 0;0;-0.2*min(max(1e6*(t-0.025),0),1)", response)
    said = "effect meet" in text and ("passed through the obstacle" if nodes else "a and the obstacle are") in text
    check(f"jump {response}", said and code == (0 if nodes else 1), text)

    # two effects for the same surfaces
    apart = TWO + BODY.format("b", "0.1,0.1,0.1:2", "0,0,0.2")
    again = f"-effect_again_type contact -effect_again_response {response} "
    code, text, _ = run("twice", apart.replace("hold,meet", "hold,meet,again") + again + "-effect_again_friction 0.5", response)
    check(f"twice {response}", code == 1 and "error: " in text and "effect_meet_on" in text and "effect_again_on" in text
          and "body a with body b" in text, text)
    selves = apart.replace("hold,meet", "hold,meet,again") + again + "-effect_meet_self yes -effect_again_self yes -effect_meet_on a -effect_again_on a "
    code, text, _ = run("selves", selves, response)
    check(f"selves {response}", code == 1 and "effect_meet_self" in text and "effect_again_self" in text and "body a with itself" in text, text)
    sides = "-effect_meet_on a.zmax,b.zmin -effect_again_on a.zmax,b.zmax "
    code, text, _ = run("sides", apart.replace("hold,meet", "hold,meet,again") + again + sides, response)
    check(f"sides {response}", code == 0, text)
    floor = "-effect_{0}_obstacle plane:0,0,{1},-0.01 "
    floors = ONE.replace("hold,meet", "hold,meet,again") + again
    code, text, _ = run("floors", floors + floor.format("meet", 1) + floor.format("again", 1), response)
    check(f"floors {response}", code == 1 and "effect_meet_obstacle" in text and "effect_again_obstacle" in text and "body a" in text, text)
    paths = floors + floor.format("meet", 1) + floor.format("again", 1) + "-effect_meet_displacement 0;0;-t -effect_again_displacement 0;0;-1*t"
    code, text, _ = run("paths", paths, response)
    check(f"paths {response}", code == 1 and "effect_meet_obstacle" in text and "effect_again_obstacle" in text, text)
    ends = "-effect_meet_obstacle capsule:0,0,0.2,0.1,0,0.2,0.01 -effect_again_obstacle capsule:0.1,0,0.2,0,0,0.2,0.01 "
    code, text, _ = run("ends", floors + ends, response)
    check(f"ends {response}", code == 1 and "effect_meet_obstacle" in text and "effect_again_obstacle" in text, text)
    spheres = "-effect_meet_obstacle sphere:0,0,0.3,0.1 -effect_again_obstacle sphere:0,0,0.4,0.1 -effect_again_displacement 0;0;-0.1"
    code, text, _ = run("spheres", floors + spheres, response)
    check(f"spheres {response}", code == 1 and "effect_meet_obstacle" in text and "effect_again_obstacle" in text, text)
    slides = floors + floor.format("meet", 1) + floor.format("again", 1) + "-effect_again_displacement t;0;0"
    code, text, _ = run("slides", slides, response)
    check(f"slides {response}", code == 1 and "effect_meet_obstacle" in text and "effect_again_obstacle" in text, text)
    other = floors + floor.format("meet", 1) + floor.format("again", 1) + "-effect_again_displacement 0;0;-t"
    code, text, _ = run("other", other, response)
    check(f"other {response}", code == 0, text)
    even = floors + floor.format("meet", 1) + floor.format("again", 1) + "-effect_again_displacement 0;0;-0.001*sin(64*pi*t/0.05)^2"
    code, text, _ = run("even", even, response)
    check(f"even {response}", code == 0, text)

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
