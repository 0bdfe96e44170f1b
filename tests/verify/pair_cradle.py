"""Restitution in a row of cubes: which bodies it is for (docs/reference/contact.md).

Cubes that are stiff within a step, and farther apart than the first one moves in a step: with restitution 1 the last one leaves with the speed of
the first, the others stay. If they touch, all impacts are one: momentum and energy stay, and the first one returns. Soft cubes lose energy to
vibrations, and a warning says so.
"""
import csv
import subprocess
import sys

import numpy

from output_common import MPI, OUT, SUPPLE

N = 5


def run(name, young, gap):
    options = "-bodies " + ",".join(f"c{k}" for k in range(N)) + " -body_c0_velocity 1,0,0 "
    for k in range(N):
        x = 0 if k == 0 else 0.1203 + (k - 1) * (0.1 + gap)
        options += (f"-body_c{k}_mesh box:0.1,0.1,0.1:2 -body_c{k}_material corotated -body_c{k}_young {young} -body_c{k}_poisson 0.3 "
                    f"-body_c{k}_density 1000 -body_c{k}_translate {x},0,0 ")
    options += ("-effects meet -effect_meet_type contact -effect_meet_restitution 1 -time euler_implicit -ts_dt 0.001 -ts_max_time 0.05 "
                "-output_fields none -output_history_bodies yes -quiet -reproducible")
    result = subprocess.run([*MPI, "1", SUPPLE, *options.split(), "-output_dir", str(OUT / name)], capture_output=True, text=True)
    if result.returncode:
        sys.exit(f"{name}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    with open(OUT / name / "history.csv", newline="") as f:
        names, _, *rows = csv.reader(f)
    found = {key: numpy.array([float(row[k]) for row in rows]) for k, key in enumerate(names)}
    speeds = [found[f"c{k}_momentum_x"][-1] for k in range(N)]  # of 1 kg each
    energy = found["kinetic"][-1] / found["kinetic"][0]
    print(f"  {name}: speeds " + " ".join(f"{v:.4f}" for v in speeds) + f", energy {energy:.4f}")
    check(abs(sum(speeds) - 1) < 1e-5, f"{name}: momentum {sum(speeds)}")
    return speeds, energy, result.stdout + result.stderr


def check(good, text):
    if not good:
        sys.exit(text)


speeds, energy, text = run("apart", 1e12, 0.002)
check(speeds[-1] > 0.999 and max(map(abs, speeds[:-1])) < 1e-3 and energy > 0.999, f"apart: speeds {speeds}, energy {energy}")
check("warning" not in text, f"apart: {text}")

speeds, energy, text = run("touching", 1e12, 0)
check(abs(speeds[0] + 0.6) < 0.01 and max(abs(v - 0.4) for v in speeds[1:]) < 0.01 and energy > 0.99, f"touching: speeds {speeds}, energy {energy}")
check("warning" not in text, f"touching: {text}")

speeds, energy, text = run("soft", 1e8, 0.002)
check(0.3 < energy < 0.9, f"soft: energy {energy}")
check("warning" in text and "restitution" in text and "body c" in text, f"soft: no warning\n{text}")
