"""A block that only a plane holds up, and touches it when a static run begins: its weight, with every response, with and without friction.

@cpu 60
"""
import csv
import os
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
SUPPLE = os.environ["SB_SUPPLE"]
WEIGHT = 1000 * .2 * .2 * .1 * 9.81
passed = failed = 0


def check(what: str, good: bool, text: str = "") -> None:
    global passed, failed
    passed, failed = passed + good, failed + (not good)
    if not good:
        print(f"FAIL {what}: {text}")


def run(response: str, ranks: int, friction: float, gap: float) -> None:
    name = f"{response}-{ranks}-{friction}-{gap}"
    command = ["scripts/mpi", str(ranks), SUPPLE, *"""-bodies a -body_a_mesh box:0.2,0.2,0.1:2,2,1 -body_a_material neohookean -body_a_young 1e5 -body_a_poisson 0.3
        -body_a_density 1000 -effects gravity,floor,hold -effect_hold_type fixed -effect_hold_on zmax -effect_hold_components xy -effect_floor_type contact
        -effect_floor_obstacle plane:0,0,1,0 -time static -quiet""".split(), "-effect_floor_response", response, "-effect_floor_friction", str(friction),
               "-body_a_translate", f"0,0,{gap}", "-output_dir", str(OUT / name)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=200)
    check(f"{name} ends", done.returncode == 0, done.stdout + done.stderr)
    if done.returncode:
        return
    with (OUT / name / "history.csv").open(encoding="utf-8") as file:
        last = list(csv.DictReader(file))[-1]
    force, centre = float(last["floor_force_z"]), float(last["centre_z"])
    check(f"{name} bears the weight", abs(force / WEIGHT - 1) < 1e-4, f"{force} N instead of {WEIGHT}")
    check(f"{name} stays on the plane", .0495 < centre < .0505, f"its centre is at {centre} m")


for response in ("projected", "multiplier", "penalty", "augmented", "barrier"):
    for friction in (0., .3):
        if response != "barrier" or not friction:
            run(response, 1, friction, 0.)
    run(response, 2, 0., 1e-9)

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
