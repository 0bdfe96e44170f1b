"""Probes follow their material point when its body is re-meshed, also over a restart; the ledger says when its point is another one.

A cube whose sides move linearly moves linearly inside, so a probe shows the linear function of the place where it was first, also when the vertex there is gone.
"""
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy

SUPPLE = os.environ.get("SB_SUPPLE", "bin/supple")
MPI = shlex.split(os.environ.get("SB_MPI", "scripts/mpi"))
OUT = Path(os.environ.get("SB_OUT", "build/test-out/remesh_probe")).resolve()
SCENE = """-bodies cube
-body_cube_mesh box:0.1,0.1,0.1:4
-body_cube_material neohookean
-body_cube_young 1e4
-body_cube_poisson 0.3
-body_cube_density 1000
-effects shear
-effect_shear_type prescribed_displacement
-effect_shear_on boundary
-effect_shear_displacement 0.3*t*x+0.2*t*z;-0.2*t*y;0.4*t*z
-time static
-static_steps 6
-snes_rtol 1e-12
-remesh_times 0.5
-probes inside,corner
-probe_inside_at 0.028,0.052,0.047
-probe_corner_at 0.1,0.1,0.1
-checkpoint_every_steps 1
-checkpoint_keep 10
"""
PLACES = {"inside": (0.025, 0.05, 0.05), "corner": (0.1, 0.1, 0.1)}


def run(ranks, folder, *more):
    line = [*MPI, str(ranks), SUPPLE, str(OUT / "scene.opts"), "-quiet", "-output_dir", str(OUT / folder), *more]
    result = subprocess.run(line, capture_output=True, text=True)
    if result.returncode:
        sys.exit(f"{folder}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout + result.stderr


def check(folder):
    lines = (OUT / folder / "history.csv").read_text().splitlines()
    names = lines[0].split(",")
    rows = numpy.array([[float(x) for x in line.split(",")] for line in lines[2:]])
    if len(rows) != 7 or rows[-1, names.index("remesh_loss")] == 0:
        sys.exit(f"{folder}: {len(rows)} rows, or not re-meshed")
    for name, (x, y, z) in PLACES.items():
        k = names.index(f"{name}_ux")
        expected = rows[:, 1:2] * numpy.array([0.3 * x + 0.2 * z, -0.2 * y, 0.4 * z])
        worst = numpy.abs(rows[:, k : k + 3] - expected).max()
        if not worst < 1e-9:
            sys.exit(f"{folder}: probe '{name}' is wrong by {worst:.3g} m")


def main():
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    (OUT / "scene.opts").write_text(SCENE)
    for element in ("p1", "cr"):
        for ranks in (1, 2):
            folder = f"{element}{ranks}"
            words = run(ranks, folder, "-body_cube_element", element)
            check(folder)
            if "probe" in words:
                sys.exit(f"{folder}: {words}")
    for step, ranks in ((3, 2), (4, 1)):
        shutil.copytree(OUT / "p12", OUT / f"from{step}")
        run(ranks, f"from{step}", "-restart", str(OUT / f"from{step}" / f"checkpoint_{step:06d}.h5"))
        check(f"from{step}")
    quantity = ("-ledger", "-ledger_quantity", "displacement", "-ledger_at")
    if "-ledger_at" not in run(1, "moved", *quantity, "0.025,0.05,0.05"):
        sys.exit("the ledger does not say that the node of its number is gone")
    if "-ledger_at" in run(1, "kept", *quantity, "0.1,0.1,0.1"):
        sys.exit("the ledger warns of a node that is there")
    print("probes follow their points through re-meshings and restarts")


main()
