"""Probes follow their material point when its body is re-meshed, also over a restart; means over facets and tets are exact; the ledger says when its point is another one.

A cube whose sides move linearly moves linearly inside, so a probe shows the linear function of the place where it was first, also when the vertex there is gone, a mean shows that of the
centre of its facets or tets, and what tets have is the same everywhere. Columns of bodies add up to those of all of them.
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
OUT = Path(os.environ.get("SB_OUT", "build/test-out/probes")).resolve()
SCENE = """-bodies cube
-body_cube_mesh box:0.1,0.1,0.1:4
-body_cube_material stable_neohookean
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
-sets half
-set_half_at box:0,0,0,0.05,0.1,0.1
-probes inside,corner,side,block
-probe_inside_at 0.028,0.052,0.047
-probe_inside_fields displacement,J,stress
-probe_corner_at 0.1,0.1,0.1
-probe_side_on xmax
-probe_side_fields displacement,position,stress
-probe_block_in half
-probe_block_fields displacement,J,von_mises
-output_history_bodies yes
-checkpoint_every_steps 1
-checkpoint_keep 10
"""
PLACES = {"inside": (0.025, 0.05, 0.05), "corner": (0.1, 0.1, 0.1), "side": (0.1, 0.05, 0.05), "block": (0.025, 0.05, 0.05)}
MU, LAMBDA = 1e4 / 2.6, 1e4 * 0.3 / (1.3 * 0.4)


def stress(t):
    """Cauchy's of the stable neo-Hookean law (Smith et al. 2018), P F^T / J, and J."""
    F = numpy.eye(3) + t * numpy.array([[0.3, 0, 0.2], [0, -0.2, 0], [0, 0, 0.4]])
    J = numpy.linalg.det(F)
    a, b = 4 / 3 * MU, LAMBDA + 5 / 6 * MU
    return a * (1 - 1 / ((F * F).sum() + 1)) * F @ F.T / J + (b * (J - 1) - 0.75 * a) * numpy.eye(3), J


def run(ranks, folder, *more, remesh=("-remesh_times", "0.5")):
    line = [*MPI, str(ranks), SUPPLE, str(OUT / "scene.opts"), "-quiet", "-output_dir", str(OUT / folder), *remesh, *more]
    result = subprocess.run(line, capture_output=True, text=True)
    if result.returncode:
        sys.exit(f"{folder}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout + result.stderr


def check(folder, block=False, remeshed=True):
    lines = (OUT / folder / "history.csv").read_text().splitlines()
    names = lines[0].split(",")
    rows = numpy.array([[float(x) for x in line.split(",")] for line in lines[2:]])
    if len(rows) != 7 or ("remesh_loss" in names and rows[-1, names.index("remesh_loss")] != 0) != remeshed:
        sys.exit(f"{folder}: {len(rows)} rows, or not re-meshed")
    moves = PLACES if block else {k: v for k, v in PLACES.items() if k != "block"}
    for name, (x, y, z) in moves.items():
        k = names.index(f"{name}_ux")
        expected = rows[:, 1:2] * numpy.array([0.3 * x + 0.2 * z, -0.2 * y, 0.4 * z])
        worst = numpy.abs(rows[:, k : k + 3] - expected).max()
        if not worst < 1e-9:
            sys.exit(f"{folder}: probe '{name}' is wrong by {worst:.3g} m")

    # quantities of tets are the same everywhere, positions are displacements from where the facets were
    def column(name):
        return rows[:, names.index(name)]

    wrong = [numpy.abs(column("side_position_x") - column("side_ux") - 0.1).max() / 0.1]
    for t, *found in zip(rows[:, 1], column("inside_J"), column("block_J"), column("side_stress_xz"), column("side_stress_zz"), column("block_von_mises"), column("inside_stress_xz")):
        s, J = stress(t)
        d = s - numpy.trace(s) / 3 * numpy.eye(3)
        wrong += [abs(found[0] - J), abs(found[1] - J), abs(found[2] - s[0, 2]) / MU, abs(found[3] - s[2, 2]) / MU]
        wrong += [abs(found[4] - (1.5 * (d * d).sum()) ** 0.5) / MU, abs(found[5] - s[0, 2]) / MU]
    # the body is all there is
    wrong += [numpy.abs(column("cube_strain") - column("strain")).max()]
    wrong += [numpy.abs(column(f"cube_centre_{k}") - column(f"centre_{k}")).max() / 0.1 for k in "xyz"]
    if not max(wrong) < 1e-8:
        sys.exit(f"{folder}: quantities of tets, positions or columns of the body are wrong by {max(wrong):.3g}")


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
    # without a re-meshing the set in space holds half of the body, whatever the element; then it holds whole tets only
    for element, ranks in (("p1", 3), ("p2", 1), ("p2", 3), ("dg", 2)):
        folder = f"{element}{ranks}"
        run(ranks, folder, "-body_cube_element", element, remesh=())
        check(folder, block=True, remeshed=False)
    for wrong in ("-probe_side_in half", "-probe_block_in zmin", "-probe_side_fields reaction", "-probe_side_fields velocity"):
        result = subprocess.run([SUPPLE, str(OUT / "scene.opts"), "-quiet", "-output_dir", str(OUT / "wrong"), *wrong.split()], capture_output=True, text=True)
        if not result.returncode or "-probe_" + wrong.split("_")[1] not in result.stderr:
            sys.exit(f"{wrong}: exit code {result.returncode}\n{result.stderr}")
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
