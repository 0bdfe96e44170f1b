"""A run that was re-meshed and is taken up behind that, on other numbers of ranks, is the run that was not interrupted; its frames name their mesh.
"""
import os
import shlex
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import h5py
import numpy

import output_common

SUPPLE = os.environ.get("SB_SUPPLE", "bin/supple")
MPI = shlex.split(os.environ.get("SB_MPI", "scripts/mpi"))
OUT = output_common.OUT


def run(ranks, folder, *more):
    line = [*MPI, str(ranks), SUPPLE, "scenarios/knead.opts", "-quiet", "-output_dir", str(OUT / folder), *more]
    result = subprocess.run(line, capture_output=True, text=True)
    if result.returncode:
        sys.exit(f"{folder}: exit code {result.returncode}\n{result.stdout}{result.stderr}")


def history(folder):
    lines = (OUT / folder / "history.csv").read_text().splitlines()
    return lines[0].split(","), numpy.array([[float(x) for x in line.split(",")] for line in lines[2:]])


def check_frames(folder):
    """Each frame's arrays have the lengths of its own mesh, and the index names that mesh."""
    meshes = set()
    with h5py.File(OUT / folder / "fields.h5", "r") as f:
        for grid in ElementTree.parse(OUT / folder / "fields.xmf").getroot().iter("Grid"):
            if grid.get("GridType") != "Uniform":
                continue
            paths = [item.text.strip().split(":")[1] for item in grid.iter("DataItem")]
            mesh = next(path for path in paths if path.endswith("/cells")).rsplit("/", 1)[0]
            frame = next(path for path in paths if path.startswith("/step/")).rsplit("/", 1)[0]
            if len(f[frame]["displacement"]) != len(f[mesh]["x"]) or len(f[frame]["von_mises"]) != len(f[mesh]["cells"]):
                sys.exit(f"{folder}: {frame} does not fit {mesh}")
            meshes.add((mesh, f[frame].attrs["step"] > 6))
    found, _ = output_common.check_vtkhdf(folder)
    if found != {"/mesh", "/mesh_000006"}:
        sys.exit(f"{folder}: meshes {found} in fields.vtkhdf")
    if meshes != {("/mesh", False), ("/mesh_000006", True)}:
        sys.exit(f"{folder}: meshes {meshes}")


def check_restart(whole, names, step, ranks):
    """Goes on from the checkpoint of a step: its history is that of the whole run."""
    folder = f"from{step}on{ranks}"
    shutil.copytree(OUT / "whole", OUT / folder)
    run(ranks, folder, "-restart", str(OUT / folder / f"checkpoint_{step:06d}.h5"))
    _, parts = history(folder)
    check_frames(folder)
    if whole.shape != parts.shape:
        sys.exit(f"{folder}: {parts.shape} rows and columns, not {whole.shape}")
    for name in ("strain", "prescribed_work", "volume", "min_J", "max_displacement", "remesh_loss"):
        k = names.index(name)
        worst = numpy.abs(whole[:, k] - parts[:, k]).max() / numpy.abs(whole[:, k]).max()
        if not worst <= 1e-6:
            sys.exit(f"{folder}: column {name} differs by {worst:.3g}")
    if not numpy.abs(parts[:, names.index("remesh_mass")]).max() < 1e-14:
        sys.exit(f"{folder}: the mass has changed")


def main():
    shutil.rmtree(OUT, ignore_errors=True)
    run(2, "whole", "-checkpoint_every_steps", "1", "-checkpoint_keep", "30")
    names, whole = history("whole")
    check_frames("whole")
    if whole[6, names.index("remesh_loss")] != 0 or whole[7, names.index("remesh_loss")] == 0:
        sys.exit("the run is not re-meshed after step 6")
    # the step before the re-meshing, the one that it comes after (whose checkpoint has the old mesh), and one with the new mesh
    for step, ranks in ((5, 1), (5, 2), (6, 1), (6, 2), (10, 1), (10, 3)):
        check_restart(whole, names, step, ranks)
    print("a re-meshed run is taken up before, at and after its re-meshing, on 1 to 3 ranks, as if not interrupted")


main()
