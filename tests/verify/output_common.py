"""What the scripts on the output share: a small scenario that writes much, and a reader of its results."""
import os
import shlex
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import h5py
import numpy

SUPPLE = str(Path(os.environ.get("SB_SUPPLE", "bin/supple")).resolve())
LAUNCHER, *FLAGS = shlex.split(os.environ.get("SB_MPI", "scripts/mpi"))
MPI = [str(Path(LAUNCHER).resolve()) if "/" in LAUNCHER else LAUNCHER, *FLAGS]
OUT = Path(os.environ.get("SB_OUT", "build/test-out/output")).resolve()

# A bar that swings: cheap steps, each of them a frame.
SCENARIO = """
-bodies bar
-body_bar_mesh box:0.4,0.1,0.1:8,2,2
-body_bar_material linear
-body_bar_young 5e4
-body_bar_poisson 0.3
-body_bar_density 1000
-sets left
-set_left_at plane:1,0,0,0
-effects gravity,hold
-effect_gravity_vector 0,0,-9.81
-effect_hold_type fixed
-effect_hold_on left
-time newmark
-ts_dt 0.01
-ts_max_time 0.2
-ksp_rtol 1e-10
-output_fields position,displacement,velocity,acceleration,stress,von_mises,J,energy_density,reaction
"""


# More bars beside it, so that all elements are in one scene; tets of p2 between others.
MIXED = ["-bodies", "bar,crouzeix,quadratic,galerkin", "-body_bar_element", "p1"]
for k, (body, element) in enumerate((("crouzeix", "cr"), ("galerkin", "dg"), ("quadratic", "p2"))):
    for option, value in (("element", element), ("mesh", "box:0.3,0.1,0.1:4,2,2"), ("translate", f"0,{0.2 * (k + 1)},0"),
                          ("material", "linear"), ("young", "4e4"), ("poisson", "0.45"), ("density", "1000")):
        MIXED += [f"-body_{body}_{option}", value]
# Options by the name of what is tested; a direct solver serves all of them.
ELEMENTS = {element: ["-body_bar_element", element, "-solver", "direct"] for element in ("p1", "cr", "dg", "p2")}
ELEMENTS["mixed"] = [*MIXED, "-solver", "direct"]


def scenario():
    OUT.mkdir(parents=True, exist_ok=True)
    path = OUT / "bar.opts"
    path.write_text(SCENARIO)
    return path


def command(ranks, folder, *more):
    return MPI + [str(ranks), SUPPLE, str(scenario()), "-output_dir", str(OUT / folder)] + [str(m) for m in more]


def run(ranks, folder, *more, fails=False, **keywords):
    """Runs the scenario; returns what it printed."""
    result = subprocess.run(command(ranks, folder, *more), capture_output=True, text=True, **keywords)
    text = result.stdout + result.stderr
    if (result.returncode != 0) != fails:
        sys.exit(f"{folder}: exit code {result.returncode}\n{text}")
    return text


def frames(folder):
    """(time, path of the group) of each frame in fields.xmf, which must be well-formed; [] without the file."""
    path = OUT / folder / "fields.xmf"
    if not path.exists():
        return []
    found = []
    for grid in ElementTree.parse(path).getroot().iter("Grid"):
        if grid.get("GridType") != "Uniform":
            continue
        items = [item.text.strip() for item in grid.iter("DataItem")]
        groups = {item.split(":")[1].rsplit("/", 1)[0] for item in items if ":/step/" in item}
        if len(groups) != 1:
            sys.exit(f"{path}: a frame has its arrays in {groups}")
        found.append((float(grid.find("Time").get("Value")), groups.pop()))
    return found


def check_frames(folder):
    """Every frame of the index is whole: its attributes, its arrays, finite numbers. Returns their number."""
    listed = frames(folder)
    if not listed:
        return 0
    with h5py.File(OUT / folder / "fields.h5", "r") as f:
        npoint, ncell = len(f["/mesh/x"]), len(f["/mesh/cells"])
        for time, group in listed:
            if f[group].attrs["time"] != time:
                sys.exit(f"{folder}: time {f[group].attrs['time']} in {group}, {time} in the index")
            for name, data in f[group].items():
                values = data[()]
                if len(values) not in (npoint, ncell) or not numpy.isfinite(values).all():
                    sys.exit(f"{folder}: {group}/{name} is not whole")
            if numpy.abs(f[group]["displacement"][()]).max() > 1 or (time > 0 and not numpy.any(f[group]["stress"][()])):
                sys.exit(f"{folder}: {group} holds wrong numbers")
    return len(listed)


def vtkhdf(path):
    """(time, data set) of each step of a .vtkhdf file, as VTK reads it; opened from another folder than the file's."""
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for time in reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()):
        reader.UpdateTimeStep(time)
        data = reader.GetOutputDataObject(0)
        data = data.GetPartition(0) if data.IsA("vtkPartitionedDataSet") else data
        copy = data.NewInstance()
        copy.ShallowCopy(data)
        yield time, copy


def check_vtkhdf(folder):
    """fields.vtkhdf against fields.h5: times, points where the bodies are, cells, and every array of each frame. Returns the meshes and
    names that were compared. `folder` below OUT."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    path, meshes, names = OUT / folder / "fields.vtkhdf", set(), set()
    with h5py.File(path, "r") as f:
        types = [f[f"/VTKHDF/{name}"].dtype for name in ("Offsets", "Connectivity")]
        if types[0] != types[1]:
            sys.exit(f"{path}: offsets and corners are {types}, and ParaView 5.13 takes them of one type only")
        arrays = [f["VTKHDF/Points"], f["VTKHDF/Connectivity"], *f["VTKHDF/PointData"].values(), *f["VTKHDF/CellData"].values()]
        copied = [data.name for data in arrays if not data.is_virtual]
    if copied:
        sys.exit(f"{path} holds copies: {copied}")
    steps, listed = list(vtkhdf(path)), frames(folder)
    if [time for time, _ in steps] != [time for time, _ in listed]:
        sys.exit(f"{path}: times {[time for time, _ in steps]}, in the other index {listed}")
    with h5py.File(OUT / folder / "fields.h5", "r") as f:
        for (_, grid), (_, group) in zip(steps, listed):
            frame = f[group]
            mesh = f[f"mesh_{frame.attrs['mesh']:06d}" if "mesh" in frame.attrs else "mesh"]
            meshes.add(mesh.name)
            expected = {"points": frame["position"] if "position" in frame else mesh["x"], "cells": mesh["cells"]}
            expected |= {name: data for name, data in frame.items() if isinstance(data, h5py.Dataset) and name != "position"}
            expected |= {name: data for name, data in mesh.items() if name not in ("x", "cells", "cells10", "vertices")}
            found = {"points": grid.GetPoints().GetData(), "cells": grid.GetCells().GetConnectivityArray()}
            for data in (grid.GetPointData(), grid.GetCellData()):
                found |= {data.GetArrayName(k): data.GetArray(k) for k in range(data.GetNumberOfArrays())}
            if found.keys() != expected.keys() or {grid.GetCellType(c) for c in range(grid.GetNumberOfCells())} != {10}:
                sys.exit(f"{path}, {group}: arrays {sorted(found)}, expected {sorted(expected)}")
            for name, data in expected.items():
                values, data = vtk_to_numpy(found[name]), data[()]
                if data.ndim == 2 and data.shape[1] == 6:
                    data = data[:, [0, 3, 5, 1, 4, 2]]  # the order of VTK
                if not numpy.array_equal(values, data.ravel() if name == "cells" else data):
                    sys.exit(f"{path}, {group}: {name} is not what fields.h5 has")
            names |= expected.keys()
    return meshes, names


def history(folder):
    """Names and rows of history.csv."""
    lines = [line for line in (OUT / folder / "history.csv").read_text().splitlines() if not line.startswith("#")]
    return lines[0].split(","), numpy.array([[float(x) for x in line.split(",")] for line in lines[1:]])
