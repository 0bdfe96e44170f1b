"""States for -body_X_state that are damaged or went astray: an error that names the option and the file, on any number of ranks. Frames that are
gone before a restart.

@ranks 1 3
@cpu 60
"""
import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

OUT = Path(os.environ["SB_OUT"])
MPI = [*os.environ["SB_MPI"].split(), os.environ["SB_RANKS"]]
BLOCK = "-bodies block -body_block_mesh box:0.1,0.1,0.1:1 -body_block_material linear -body_block_young 1e5 -body_block_poisson 0.3 -ts_dt 0.01 -ts_max_time 0.01 -quiet"
found = []


def run(name, options):
    return subprocess.run([*MPI, os.environ["SB_SUPPLE"], *BLOCK.split(), *options.split(), "-output_dir", str(OUT / name)], capture_output=True, text=True)


def set_first(name, value):
    def damage(file):
        file[name][0] = value
    return damage


def flatten(file):
    file["mesh/x"][:, 2] = 0


result = run("good", "-body_block_velocity 1,0,0 -output_fields displacement,velocity")
if result.returncode:
    sys.exit(result.stdout + result.stderr)
with h5py.File(OUT / "good" / "fields.h5") as f:
    steps = []
    for hundred in f["step"]:
        steps += [f"step/{hundred}/{name}" for name in f["step"][hundred]]
LAST = steps[-1]
CASES = {
    "nan": set_first(f"{LAST}/displacement", np.nan),
    "infinite": set_first(f"{LAST}/velocity", np.inf),
    "far": set_first(f"{LAST}/displacement", 1e38),
    "mesh_far": set_first("mesh/x", 1e200),
    "cells": set_first("mesh/cells", 99),
    "flat": flatten,
}
for name, damage in CASES.items():
    folder = OUT / name
    shutil.copytree(OUT / "good", folder)
    with h5py.File(folder / "fields.h5", "r+") as f:
        damage(f)
    result = run("again_" + name, f"-body_block_state {folder}")
    text = result.stdout + result.stderr
    if result.returncode == 0 or text.count("error: ") != 1 or "-body_block_state" not in text or str(folder) not in text:
        found.append(f"{name}: code {result.returncode}: {text}")
result = run("again_good", f"-body_block_state {OUT / 'good'}")
if result.returncode:
    found.append(f"good: {result.stderr}")

# the last frame as a mesh
result = run("frame", f"-body_block_mesh {OUT / 'far' / 'fields.h5'} -body_block_mesh_step -1")
if result.returncode == 0 or "1e+15 m" not in result.stderr:
    found.append(f"frame: code {result.returncode}: {result.stderr}")

# frames that are gone where a run goes on are said; they go on in a new file. In another folder there were none
first = run("gone", "-checkpoint_every_steps 1")
shutil.copytree(OUT / "gone", OUT / "kept")
(OUT / "gone" / "fields.h5").unlink()
more = "-ts_max_time 0.02 -restart "
for name, options, said in (("gone", more + "latest", 1), ("kept", more + "latest", 0), ("other", more + str(OUT / "kept" / "checkpoint_000001.h5"), 0)):
    result = run(name, options)
    good = result.returncode == 0 and result.stderr.count("warning") == said and (OUT / name / "fields.h5").is_file()
    if not good or (said and str(OUT / "gone" / "fields.h5") not in result.stderr):
        found.append(f"{name}: code {result.returncode}: {first.stderr} {result.stderr}")
print("\n".join(found) or f"{len(CASES) + 5} passed, 0 failed")
sys.exit(bool(found))
