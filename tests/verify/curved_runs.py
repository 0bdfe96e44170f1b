"""Runs on curved tets: an .h5 mesh made by the description of its layout, and as supple-mesh converts it, on any number of ranks; checkpoints of before and after a re-meshing
are taken up on other numbers of ranks as if the run had not been interrupted; a body of another run begins with what it had; straight tets between the same vertices are another mesh.
"""
import itertools
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy

from output_common import MPI, OUT, SUPPLE

TOOL = str(Path(SUPPLE).with_name("supple-mesh"))
SCENE = ["-bodies", "a", "-body_a_element", "p2", "-body_a_material", "stable_neohookean", "-body_a_young", "1e5", "-body_a_poisson", "0.45", "-body_a_density", "1000",
         "-body_a_angular_velocity", "0.5,1,2", "-sets", "foot", "-set_foot_at", "plane:1,0,0,0,0.1", "-effects", "hold,weight", "-effect_hold_type", "fixed", "-effect_hold_on", "foot",
         "-effect_weight_type", "gravity", "-time", "newmark", "-ts_dt", "0.005", "-ts_max_time", "0.04", "-solver", "direct", "-snes_rtol", "1e-13", "-remesh_times", "0.02",
         "-checkpoint_every_steps", "1", "-checkpoint_keep", "20", "-output_quadratic", "yes", "-output_precision", "double", "-output_fields", "displacement,velocity", "-quiet"]


def check(condition, text):
    if not condition:
        sys.exit(text)


def run(ranks, folder, mesh, *more, fails=""):
    done = subprocess.run([*MPI, str(ranks), SUPPLE, *SCENE, "-body_a_mesh", str(OUT / mesh), "-output_dir", str(OUT / folder), *more], capture_output=True, text=True)
    check(bool(done.returncode) == bool(fails) and fails in done.stderr, f"{folder}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


def tool(*words):
    done = subprocess.run([TOOL, *map(str, words)], capture_output=True, text=True)
    check(done.returncode == 0, f"{words}: {done.stdout}{done.stderr}")
    return done.stdout


def same(name, first, second, most=1e-10):
    """Displacement and velocity of two checkpoints."""
    with h5py.File(OUT / first) as a, h5py.File(OUT / second) as b:
        for field in "uv":
            check(a[field].shape == b[field].shape, f"{name}: {a[field].shape} and {b[field].shape}")
            worst = numpy.abs(a[field][()] - b[field][()]).max() / numpy.abs(a[field][()]).max()
            check(worst < most, f"{name}: {field} differs by {worst:.3g}")


def bend(path):
    """Moves the nodes of edges as x -> x + f(x) would, beyond x = 0.3: the rest stays straight."""
    with h5py.File(path, "r+") as f:
        x, cells = f["mesh/x"][()], f["mesh/cells"][()]
        edges = numpy.unique(numpy.sort(numpy.concatenate([cells[:, pair] for pair in itertools.combinations(range(4), 2)]), axis=1), axis=0)

        def motion(y):
            return 0.06 * numpy.sin(y[:, [1, 2, 0]] * 4 + 3 * y[:, [2, 0, 1]])

        a, b = x[edges[:, 0]], x[edges[:, 1]]
        off = motion((a + b) / 2) - (motion(a) + motion(b)) / 2
        kept = numpy.maximum(a[:, 0], b[:, 0]) > 0.3
        f["mesh/curved_edges"] = edges[kept].astype("i4")[::-1]  # in any order
        f["mesh/edge_offsets"] = off[kept][::-1]
        f.attrs["supple_mesh"] = 2


OUT.mkdir(parents=True, exist_ok=True)
tool("convert", "box:1,0.5,0.5:2", OUT / "straight.h5")
tool("convert", "box:1,0.5,0.5:2", OUT / "curved.h5")
bend(OUT / "curved.h5")
for end in ("msh", "h5"):
    said = tool("convert", OUT / "curved.h5", OUT / f"again.{end}")
    check("off the middle" in said, said)
report = tool("info", OUT / "again.msh")
check("curved tets" in report, report)

# a damaged one is refused by all commands; edges of one that folds are made straight, and that is said
for name, edge in (("lost.h5", [1, 6]), ("folded.h5", [0, 1])):
    tool("convert", "box:1,0.5,0.5:1", OUT / name)
    with h5py.File(OUT / name, "r+") as f:
        f["mesh/curved_edges"], f["mesh/edge_offsets"] = [edge], [[2.0, 0, 0]]
        f.attrs["supple_mesh"] = 2
for command in ("info", "convert", "repair", "refine"):
    done = subprocess.run([TOOL, command, str(OUT / "lost.h5"), *([str(OUT / "not.h5")] if command != "info" else [])], capture_output=True, text=True)
    check(done.returncode and "/mesh/curved_edges" in done.stderr and "row 1" in done.stderr and not (OUT / "not.h5").exists(), f"{command}: {done.stdout}{done.stderr}")
run(3, "lost", "lost.h5", "-mesh_reading", "slabs", fails="row 1")
report = tool("info", OUT / "folded.h5")
check("made straight: 2" in report, report)
report = tool("repair", OUT / "folded.h5", OUT / "unfolded.h5")
check("made straight" in report and "made straight" not in tool("info", OUT / "unfolded.h5"), report)
for reading in ("rank0", "slabs"):
    run(3, f"folded_{reading}", "folded.h5", "-mesh_reading", reading)
same("a folded one in slabs", "folded_rank0/checkpoint_000008.h5", "folded_slabs/checkpoint_000008.h5")

# the mesh, by any way and on any number of ranks
run(1, "whole", "curved.h5")
last = "checkpoint_000008.h5"
run(1, "msh", "again.msh")
same("the .msh", f"whole/{last}", f"msh/{last}")
run(3, "slabs", "again.h5", "-mesh_reading", "slabs")
same("in slabs", f"whole/{last}", f"slabs/{last}")
with open(OUT / "whole/history.csv", encoding="ascii") as f:
    names, _, *rows = f.read().splitlines()
row = dict(zip(names.split(","), map(float, rows[-1].split(","))))
check(row["remesh_loss"] != 0 and row["remesh_mass"] < 1e-12 and row["min_J"] > 0, f"{row}")

# a frame behind the re-meshing is a mesh, too, which is another one than that of /mesh
report = tool("info", OUT / "whole/fields.h5", "-step", -1)
volume = float(re.search(r"volume +(\S+) m", report).group(1))
check(abs(volume / row["volume"] - 1) < 1e-5, f"volume {volume} of the last frame, {row['volume']} in history.csv")

# interrupted before, at and after the re-meshing
for step, ranks in ((2, 3), (4, 3), (6, 3), (6, 1)):
    run(ranks, f"from{step}on{ranks}", "curved.h5", "-restart", str(OUT / f"whole/checkpoint_00000{step}.h5"))
    same(f"step {step} on {ranks}", f"whole/{last}", f"from{step}on{ranks}/{last}")
run(2, "other", "straight.h5", "-restart", str(OUT / "whole/checkpoint_000002.h5"), fails="another mesh")

# a body that begins as another run ended, or went
with h5py.File(OUT / "whole/fields.h5") as f:
    want = f["step/0000/000003/displacement"][()]
for name, state in (("frame", f"{OUT / 'whole'},3"), ("checkpoint", str(OUT / "whole/checkpoint_000003.h5"))):
    run(3, name, "curved.h5", "-body_a_state", state, "-ts_max_time", "0.005")
    with h5py.File(OUT / name / "fields.h5") as f:
        off = numpy.abs(f["step/0000/000000/displacement"][()] - want).max() / numpy.abs(want).max()
    check(off < 1e-12, f"-body_a_state, {name}: displacements differ by {off:.3g}")
# by default frames have linear tets, which are parts of the same curved ones: for a mesh, and for a state
run(2, "cut", "curved.h5", "-output_quadratic", "no")
with h5py.File(OUT / "cut/fields.h5") as f, h5py.File(OUT / "whole/fields.h5") as g:
    for mesh in (name for name in f if name.startswith("mesh")):
        x, cells = f[f"{mesh}/x"][()], f[f"{mesh}/cells"][()]
        least = numpy.linalg.det(x[cells[:, 1:]] - x[cells[:, :1]]).min()
        check((f[f"{mesh}/cells10"][()] == g[f"{mesh}/cells10"][()]).all() and least > 0, f"{mesh}: other tets than the quadratic ones, or det {least:.3g} of a part")
    check(len([name for name in f if name.startswith("mesh")]) == 2, "not re-meshed")
cut = tool("info", OUT / "cut/fields.h5", "-step", -1)
check(cut.splitlines()[1:] == report.splitlines()[1:], f"a mesh of linear tets' parents:\n{cut}\n{report}")
run(3, "state", "curved.h5", "-body_a_state", f"{OUT / 'cut'},3", "-ts_max_time", "0.005")
with h5py.File(OUT / "state/fields.h5") as f:
    off = numpy.abs(f["step/0000/000000/displacement"][()] - want).max() / numpy.abs(want).max()
check(off < 1e-12, f"-body_a_state, linear tets: displacements differ by {off:.3g}")

# a coarse shell whose tets are bent so strongly that hardly one of the new ones is good is given up soon, and keeps its mesh
(OUT / "ball.geo").write_text('SetFactory("OpenCASCADE"); Sphere(1) = {0, 0, 0, 0.05}; Sphere(2) = {0, 0, 0, 0.025}; BooleanDifference(3) = {Volume{1}; Delete;}{Volume{2}; Delete;};\n'
                              'Physical Volume("ball") = {3}; Mesh.MeshSizeMin = 0.025; Mesh.MeshSizeMax = 0.025; Mesh.HighOrderOptimize = 0; Mesh.ElementOrder = 2;\n')
subprocess.run(["gmsh", "-3", "-format", "msh41", "-v", "0", "-o", OUT / "ball.msh", OUT / "ball.geo"], check=True)
done = subprocess.run([SUPPLE, *SCENE, "-body_a_mesh", str(OUT / "ball.msh"), "-set_foot_at", "halfspace:0,0,1,-0.03", "-ts_max_time", "0.03", "-checkpoint_every_steps", "0", "-output_dir", str(OUT / "ball")],
                      capture_output=True, text=True)
# 304 tets, which splits had made 8,000
check(done.returncode == 0 and max(map(int, re.findall(r"\d+", done.stderr)), default=0) < 2000, f"a coarse shell: {done.stderr}")
print("curved tets in .h5 and .msh, in slabs, across restarts, re-meshing and states of other runs")
