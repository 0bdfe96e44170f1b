"""The ventricle of Land et al. (2015), problems 2 and 3, on the coarsest mesh of scripts/ventricle: its volume, its fibres, and where the apices end.

@cpu 120
"""
import importlib.machinery
import importlib.util
import math
import shutil
import sys
from pathlib import Path

if not shutil.which("gmsh"):
    print("gmsh is missing")
    sys.exit(77)
import h5py
import numpy

from output_common import OUT, SUPPLE
from scene_common import check, finish, near

sys.path.insert(0, str(Path("scripts").resolve()))
loader = importlib.machinery.SourceFileLoader("ventricle", "scripts/ventricle")
ventricle = importlib.util.module_from_spec(importlib.util.spec_from_loader("ventricle", loader))
sys.modules["ventricle"] = ventricle
loader.exec_module(ventricle)

OUT.mkdir(parents=True, exist_ok=True)

# fibres: along the wall at its surfaces, around it in the middle; unit vectors, without a part across the wall
x = numpy.array([[7.0, 0, 0], [0, 10, 0], [8.5, 0, 0]])
check(numpy.allclose(ventricle.fibres(x), [[0, 0, 1], [0, 0, -1], [0, 1, 0]], atol=1e-12), f"fibres at the height 0: {ventricle.fibres(x)}")
x = numpy.array([[3.0, 4.0, -12.0], [2.0, -6.5, 2.0]])
h = 1e-6
slope = numpy.column_stack([(ventricle.depth(numpy.hypot(*(x + d)[:, :2].T), (x + d)[:, 2]) - ventricle.depth(numpy.hypot(*(x - d)[:, :2].T), (x - d)[:, 2])) / (2 * h) for d in h * numpy.eye(3)])
f = ventricle.fibres(x)
check(abs((f * f).sum(axis=1) - 1).max() < 1e-12 and abs((f * slope).sum(axis=1)).max() < 1e-8 * abs(slope).max(), f"fibres {f}, normals {slope}")

# the shape: of a segment of an ellipsoid of revolution, pi r^2 (z - z^3/(3 a^2)) from -a to the base
path = OUT / "layers2.h5"
ntet = ventricle.mesh(SUPPLE, 2, path)
segment = lambda r, a: math.pi * r**2 * (5 - 125 / (3 * a**2) + 2 * a / 3)
exact = segment(10, 20) - segment(7, 17)
with h5py.File(path, "r") as file:
    check(len(file["mesh/fibre"]) == ntet == len(file["mesh/cells"]), "fibres of the mesh")
for problem, inside, outside in zip(ventricle.PROBLEMS, (-26.70, -14.955), (-27.96, -18.585)):
    run = ventricle.run(SUPPLE, problem, path, OUT / f"problem{problem.number}")
    if problem.number == 2:
        near(float(run.history["volume"][0]) * 1e9, exact, 2e-3 * exact, "volume of the wall at rest, mm^3")
    values = ventricle.apices(run)
    # what this mesh had when it was first run; the page has finer ones
    near(values[0], inside, 0.02, f"problem {problem.number}, apex inside, mm")
    near(values[1], outside, 0.02, f"problem {problem.number}, apex outside, mm")
    check(run.history["inverted"].max() == 0, "tets turn over")
    run.close()
finish()
