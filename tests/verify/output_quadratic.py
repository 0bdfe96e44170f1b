"""-output_quadratic: bodies of p2 with all their nodes, opened by VTK: quadratic tets whose middle nodes show a quadratic displacement exactly, on any number of ranks; restarts go on with the same; a body of
another run begins with such frames; python/supple reads them.

"""
import subprocess
import sys
from pathlib import Path

import h5py
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

from output_common import MPI, OUT, SUPPLE

sys.path.insert(0, str(Path("python").resolve()))
import supple

# Bending by prescribed displacements: u = (x z, 0, -x^2 / 2) with nu = 0 and the linear law is in equilibrium under body forces that p2 need not know, as every node is prescribed.
SCENE = ["-bodies", "bar", "-body_bar_mesh", "box:0.2,0.1,0.1:2", "-body_bar_material", "linear", "-body_bar_young", "1e4", "-body_bar_poisson", "0", "-body_bar_density", "1000", "-body_bar_element", "p2",
         "-effects", "bend", "-effect_bend_type", "prescribed_displacement", "-effect_bend_on", "bar", "-effect_bend_displacement", "t*x*z;0;-0.5*t*x^2", "-ts_dt", "0.1", "-ts_max_time", "0.3",
         "-output_fields", "position,displacement,stress,reaction,sets", "-output_quadratic", "yes", "-output_precision", "double", "-checkpoint_every_steps", "1", "-quiet"]


def run(ranks, folder, *more, fails=""):
    done = subprocess.run([*MPI, str(ranks), SUPPLE, *SCENE, "-output_dir", str(OUT / folder), *more], capture_output=True, text=True)
    if bool(done.returncode) != bool(fails) or fails not in done.stderr:
        sys.exit(f"{folder}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


def check(condition, text):
    if not condition:
        sys.exit(text)


def bent(x, t):
    return t * numpy.stack([x[:, 0] * x[:, 2], 0 * x[:, 0], -0.5 * x[:, 0] ** 2], axis=1)


for ranks in (1, 3):
    run(ranks, f"on{ranks}")
    reader = vtkHDFReader()
    reader.SetFileName(str(OUT / f"on{ranks}" / "fields.vtkhdf"))
    reader.UpdateInformation()
    reader.SetStep(3)
    reader.Update()
    grid = reader.GetOutput()
    grid = grid if grid.IsA("vtkUnstructuredGrid") else grid.GetPartition(0)
    cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 10)
    check(grid.GetNumberOfCells() == len(cells) and grid.GetCellType(0) == 24, "no quadratic tets")
    u, x = vtk_to_numpy(grid.GetPointData().GetArray("displacement")), vtk_to_numpy(grid.GetPoints().GetData())
    rest = x - u
    check(numpy.abs(u - bent(rest, 0.3)).max() < 1e-15, f"displacement of the nodes: {numpy.abs(u - bent(rest, 0.3)).max()}")
    middle = (rest[cells[:, [0, 1, 2, 0, 1, 2]]] + rest[cells[:, [1, 2, 0, 3, 3, 3]]]) / 2
    check(numpy.abs(rest[cells[:, 4:]] - middle).max() < 1e-15, "middle nodes are not where VTK has them")
    check(vtk_to_numpy(grid.GetPointData().GetArray("reaction")).shape == u.shape, "reactions")
    with h5py.File(OUT / f"on{ranks}" / "fields.h5") as file:
        check((file["mesh/cells10"][:, :4] == file["mesh/cells"][:]).all() and file["mesh/set_bar"][:].all() and "Tetrahedron_10" in (OUT / f"on{ranks}" / "fields.xmf").read_text(), "cells10, sets")
        data = {name: file[f"mesh/{name}"][:] for name in ("x", "cells", "cells10")}
    if ranks == 1:
        first = data
    check(all((data[name] == first[name]).all() for name in data), "the file depends on the number of ranks")

it = supple.Run(OUT / "on3")
check(numpy.abs(it.data("displacement", -1) - bent(it.mesh().x, 0.3)).max() < 1e-15 and len(it.mesh().surface.points) < len(it.mesh().x), "python/supple")
check((it.mesh().cells10 == data["cells10"]).all() and "cells10" not in it.fields(), f"cells10 are among the fields {it.fields()}")
run(2, "on1", "-restart", "latest", "-ts_max_time", "0.4")
check(len(supple.Run(OUT / "on1")) == 5, "a restart does not go on with the frames")
run(1, "on1", "-restart", "latest", "-ts_max_time", "0.5", "-output_quadratic", "no", fails="-output_quadratic")
run(1, "next", "-body_bar_state", str(OUT / "on3"), "-effect_bend_on", "xmin", "-ts_dt", "1e-9", "-ts_max_time", "1e-9", "-body_bar_element", "p2")
check(numpy.abs(supple.Run(OUT / "next").data("displacement", 0)[:, 2].min() + 0.5 * 0.3 * 0.2**2) < 1e-6, "a state from such frames")
run(1, "mixed", "-body_bar_element", "cr", fails="-output_quadratic")
run(1, "both", "-output_discontinuous", "yes", fails="-output_discontinuous")
print("quadratic tets are what VTK takes for them")
