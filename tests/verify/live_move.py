"""An obstacle that is moved by hand while the run goes on: it follows live.txt no faster than -live_speed, what it does can be repeated from the history, a restart goes on with it, and the run keeps time.
"""
import os
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy

SUPPLE = os.environ.get("SB_SUPPLE", "bin/supple")
MPI = shlex.split(os.environ.get("SB_MPI", "scripts/mpi"))
OUT = Path(os.environ.get("SB_OUT", "build/test-out/live_move")).resolve()
SCENE = """-bodies block
-body_block_mesh box:0.1,0.1,0.05:3
-body_block_material corotated
-body_block_young 2e4
-body_block_poisson 0.3
-body_block_density 1000
-effects hold,tool
-effect_hold_type fixed
-effect_hold_on zmin
-effect_tool_type contact
-effect_tool_on zmax
-effect_tool_obstacle sphere:0.05,0.05,0.08,0.02
-ts_dt 0.01
-output_fields none
-snes_rtol 1e-10
-quiet
"""


def command(ranks, folder, *more):
    return [*MPI, str(ranks), SUPPLE, str(OUT / "scene.opts"), "-output_dir", str(OUT / folder), *more]


def history(folder):
    lines = (OUT / folder / "history.csv").read_text().splitlines()
    return {name: numpy.array([float(line.split(",")[k]) for line in lines[2:]]) for k, name in enumerate(lines[0].split(","))}


def fail(text):
    sys.exit(text)


def put(folder, text):
    (OUT / folder / "new").write_text(text)
    (OUT / folder / "new").rename(OUT / folder / "live.txt")


shutil.rmtree(OUT, ignore_errors=True)
(OUT / "live").mkdir(parents=True)
(OUT / "scene.opts").write_text(SCENE)

# Down into the block, and when force is there sideways: what it does next depends on what came.
put("live", "# x y z\nnobody 1 1 1\ntool 0 0 -0.02\n")
begun = time.monotonic()
run = subprocess.Popen(command(2, "live", "-effect_tool_displacement", "live", "-live_speed", "0.1", "-live_pace", "0.4", "-ts_max_time", "1000", "-checkpoint_every_steps", "20", "-checkpoint_keep", "1000"),
                       stderr=(OUT / "told.txt").open("w"))
# However busy the machine is: it is stopped when the tool has been where it was wanted last for some steps.
there = 0
while run.poll() is None and time.monotonic() - begun < 600:
    try:
        h = history("live")
        if abs(h["tool_force_z"][-1]) > 0:
            put("live", "tool 0.01, 0, -0.02 and more\n")
        there = (numpy.abs(h["tool_live_x"] - 0.01) < 1e-12).sum()
        if there > 5 and len(h["time"]) > 45:
            run.terminate()
            run.wait()
    except (OSError, ValueError, IndexError):
        pass
    time.sleep(0.05)
elapsed = time.monotonic() - begun
if run.returncode != 75:
    run.kill()
    fail(f"exit code {run.returncode}, {there} steps at the place that was wanted")
told = (OUT / "told.txt").read_text()
if told.count("warning") != 1 or "nobody 1 1 1" not in told or "`tool`" not in told:
    fail(f"of a line that names nothing the run says: {told}")
h = history("live")
place = numpy.stack([h[f"tool_live_{k}"] for k in "xyz"], 1)
speed = numpy.linalg.norm(numpy.diff(place, axis=0), axis=1) / numpy.diff(h["time"])
if not (abs(place[-1] - [0.01, 0, -0.02]).max() < 1e-12 and abs(speed.max() - 0.1) < 1e-9):
    fail(f"the tool is at {place[-1]}, and was {speed.max()} m/s fast")
if not h["tool_force_z"].max() - h["tool_force_z"].min() > 0.1:
    fail("nothing was pressed")
end = h["time"][-1]
if elapsed < end / 0.4:
    fail(f"{end} s at 0.4 of real time took {elapsed} s")

# The same once more: the places of the history as tables, on another number of ranks.
for k in "xyz":
    (OUT / f"{k}.txt").write_text("".join(f"{t!r} {x!r}\n" for t, x in zip(h["time"].tolist(), h[f"tool_live_{k}"].tolist())))
path = ";".join(f"table:{OUT}/{k}.txt" for k in "xyz")
subprocess.run(command(1, "again", "-effect_tool_displacement", path, "-ts_max_time", repr(float(end))), check=True)
g = history("again")
for column in ("strain", "tool_force_z", "tool_force_x"):
    if not abs(h[column] - g[column]).max() < 1e-6 * abs(h[column]).max():
        fail(f"{column}: the same path gives something else")

# A restart begins where the tool was, and goes to where it is wanted now.
shutil.copytree(OUT / "live", OUT / "on")
put("on", "tool 0 0 0\n")
subprocess.run(command(2, "on", "-effect_tool_displacement", "live", "-live_pace", "0", "-ts_max_time", "0.6", "-output_overwrite", "yes", "-restart", str(OUT / "on" / "checkpoint_000040.h5")), check=True)
g = history("on")
if not (abs(g["tool_live_x"][40] - h["tool_live_x"][40]) < 1e-15 and abs(g["tool_live_z"][-1]) < 1e-12 and g["tool_live_z"][41] < -0.01):
    fail("a restart does not go on where the tool was")

# An angle and a traction: the one is reached at its speed, the other at once; tables of the history do the same.
turn = ["-effects", "hold,push", "-effect_hold_type", "prescribed_displacement", "-effect_hold_axis_point", "0.05,0.05,0", "-effect_push_type", "traction", "-effect_push_on", "zmax", "-ts_max_time", "0.1"]
(OUT / "turn").mkdir()
put("turn", "hold_angle 5\npush_vector 0 50 100\npush_vector 1 1\n")
subprocess.run(command(2, "turn", *turn, "-effect_hold_angle", "live", "-effect_push_vector", "live", "-live_angular_speed", "100", "-live_pace", "0", "-output_overwrite", "yes"), check=True)
h = history("turn")
if not (abs(h["hold_angle_live"] - numpy.minimum(100 * h["time"], 5)).max() < 1e-12 and (h["push_vector_live_z"][1:] == 100).all() and h["push_vector_live_z"][0] == 0):
    fail(f"angle {h['hold_angle_live']}, traction {h['push_vector_live_z']}")
subprocess.run(command(1, "turned", *turn, "-effect_hold_angle", "clamp(100*t,0,5)", "-effect_push_vector", "0;50;100"), check=True)
g = history("turned")
if not (abs(h["strain"] - g["strain"]).max() < 1e-8 * g["strain"].max() and g["strain"].max() > 0):
    fail(f"an angle that is set by hand gives {h['strain']}, as a formula {g['strain']}")

# What it is not for.
result = subprocess.run(command(1, "static", "-effect_tool_displacement", "live", "-time", "static"), capture_output=True, text=True)
if not result.returncode or "-time static" not in result.stderr or "live" not in result.stderr:
    fail(f"a static run: {result.stderr}")
print("an obstacle goes where it is wanted, and the same way again")
