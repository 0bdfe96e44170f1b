"""fields.xmf and fields.vtkhdf as VTK reads them: frames, times, names, values; and the same datasets on 1, 2, 3 and 4 ranks; by element, and
with points of its own for each cell.


vtkXdmfReader is what PyPI's VTK has; vtkXdmf3Reader is tried where there is one. Values are compared with those of fields.h5
and, for the first and last frame, with history.csv.
"""
import os
import sys

import h5py
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

from output_common import ELEMENTS, OUT, check_frames, check_vtkhdf, frames, history, run

VECTORS = ["position", "displacement", "velocity", "acceleration", "reaction"]
CELLS = {"stress": 6, "von_mises": 1, "J": 1, "energy_density": 1}
PRESSURES = {"pressure": 1, "mean_pressure": 1}


def readers():
    found = [vtkXdmfReader]
    try:
        from vtkmodules.vtkIOXdmf3 import vtkXdmf3Reader
        found.append(vtkXdmf3Reader)
    except ImportError:
        pass
    return found


def grid_at(reader, time):
    reader.UpdateTimeStep(time)
    grid = reader.GetOutputDataObject(0)
    while grid.IsA("vtkMultiBlockDataSet"):
        grid = grid.GetBlock(0)
    return grid


def tensor6(array):
    """xx xy xz yy yz zz of a tensor that the reader may have made full."""
    return array[:, [0, 1, 2, 4, 5, 8]] if array.shape[1] == 9 else array


def check(condition, text):
    if not condition:
        sys.exit(text)


def check_reader(make, folder, path, vertices=True, fields=CELLS):
    """vertices: unknowns are those of vertices, whose largest displacement history.csv tells."""
    reader = make()
    reader.SetFileName(path)
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    names, rows = history(folder)
    check(numpy.array_equal(times, rows[:, names.index("time")]), f"{make.__name__}: times {times[:4]}...")
    groups = dict(frames(folder))
    with h5py.File(OUT / folder / "fields.h5", "r") as f:
        for k in (0, len(times) // 3, len(times) - 1):
            grid, group = grid_at(reader, times[k]), f[groups[times[k]]]
            check(numpy.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), f["/mesh/x"][()]), f"{make.__name__}: points")
            cells = numpy.array([[grid.GetCell(c).GetPointId(a) for a in range(4)] for c in range(grid.GetNumberOfCells())])
            check(grid.GetCellType(0) == 10 and numpy.array_equal(cells, f["/mesh/cells"][()]), f"{make.__name__}: cells")
            points, on_cells = grid.GetPointData(), grid.GetCellData()
            check(points.GetNumberOfArrays() == len(VECTORS), f"{make.__name__}: {points.GetNumberOfArrays()} point arrays")
            for name in VECTORS:
                check(numpy.array_equal(vtk_to_numpy(points.GetArray(name)), group[name][()]), f"{make.__name__}: {name}")
            for name, n in fields.items():
                array = vtk_to_numpy(on_cells.GetArray(name))
                array = tensor6(array) if n == 6 else array
                check(numpy.array_equal(array, group[name][()]), f"{make.__name__}: {name}")
            check(numpy.array_equal(vtk_to_numpy(on_cells.GetArray("body")), f["/mesh/body"][()]), f"{make.__name__}: body")
            largest = numpy.linalg.norm(group["displacement"][()], axis=1).max()
            told = rows[k, names.index("max_displacement")]
            check(not vertices or abs(largest - told) <= 1e-6 * told, f"displacement {largest} in fields.h5, {told} in history.csv")
            x, cells, J = f["/mesh/x"][()], f["/mesh/cells"][()], group["J"][()].astype(float)
            volume = numpy.abs(numpy.linalg.det(x[cells[:, 1:]] - x[cells[:, :1]])) @ J / 6
            told = rows[k, [names.index(name) for name in ("volume", "min_J")]]
            # the rounding of J to a float; history has the least J of p2 in its points, frames the mean of each tet
            least = min(J.min(), told[1]) if "parent" in f["mesh"] else J.min()
            check(numpy.abs(told / (volume, least) - 1).max() <= 1e-6, f"volume and least J {volume}, {J.min()}, history {told}")
            # the reaction balances weight and inertia only in rest; its sum is what history says
            sums = group["reaction"][()].astype(float).sum(axis=0)
            told = rows[k, [names.index(f"hold_reaction_{c}") for c in "xyz"]]
            check(numpy.abs(sums - told).max() <= 1e-5 * numpy.abs(told).max() + 1e-9, f"reactions {sums}, history {told}")
    print(f"{make.__name__}: {len(times)} frames of {path}")


def datasets(folder):
    found = {}
    with h5py.File(OUT / folder / "fields.h5", "r") as f:
        f.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
    return found


def check_ranks(folders, tolerance):
    """Constant data equal to the bit; fields to a part of the largest value of their kind."""
    first = datasets(folders[0])
    for folder in folders[1:]:
        other = datasets(folder)
        check(first.keys() == other.keys(), f"{folder} has other datasets: {first.keys() ^ other.keys()}")
        for name in first:
            kind = name.rsplit("/", 1)[-1]
            if name.startswith("mesh/"):
                check(numpy.array_equal(first[name], other[name]), f"{name} differs between {folders[0]} and {folder}")
                continue
            scale = max(numpy.abs(values).max() for other_name, values in first.items() if other_name.endswith("/" + kind))
            worst = numpy.abs(first[name] - other[name]).max() / scale
            check(worst <= tolerance, f"{name} differs by {worst:.2g} of the largest between {folders[0]} and {folder}")
    print(f"{len(first)} datasets are the same in {', '.join(folders)}")


def check_elements():
    """Each element, and all in one scene: the same on any number of ranks, and what the readers find."""
    more = ["-ts_max_time", "0.04", "-output_precision", "double", "-quiet",
            "-output_fields", ",".join([*VECTORS, *CELLS, *PRESSURES])]
    for element in ("cr", "dg", "p2", "mixed"):
        for name, option in ((element, []), (f"{element}-corners", ["-output_discontinuous"])):
            folders = [f"{name}{ranks}" for ranks in (1, 2, 3)]
            for ranks, folder in zip((1, 2, 3), folders):
                run(ranks, folder, *ELEMENTS[element], *more, *option)
                check(check_frames(folder) == 5, f"{folder}: {check_frames(folder)} frames, expected 5")
            # direct solves to rounding, of matrices with condition numbers near 1e5
            check_ranks(folders, 1e-9)
            for make in readers():
                check_reader(make, folders[2], str(OUT / folders[2] / "fields.xmf"), vertices=element == "p2", fields=CELLS | PRESSURES)
            check_vtkhdf(folders[2])
        check_corners(f"{element}1", f"{element}-corners1")


def check_corners(mean, corners):
    """The corners of the cells around a vertex: their mean by volume is the vertex's value, and they are not all alike."""
    path = frames(mean)[-1][1]
    with h5py.File(OUT / mean / "fields.h5", "r") as f, h5py.File(OUT / corners / "fields.h5", "r") as g:
        x, cells, u = (f[name][()] for name in ("/mesh/x", "/mesh/cells", f"{path}/displacement"))
        points = g["/mesh/cells"][()]
        own = g[f"{path}/displacement"][()][points]
        check(numpy.array_equal(g["/mesh/vertices"][()], cells), f"{corners}: other vertices than {mean} has")
        # each of the scene's tets has points of its own
        tet = numpy.repeat(g["/mesh/parent"] if "parent" in g["mesh"] else numpy.arange(len(cells)), 4)
        count = len(numpy.unique(numpy.stack([points.ravel(), tet]), axis=1).T)
        check(count == len(g["/mesh/x"]) == points.max() + 1, f"{corners}: cells")
        check(numpy.array_equal(g["/mesh/x"][()][points], x[cells]), f"{corners}: places of the corners")
        p, q = g[f"{path}/pressure"][()], f[f"{path}/pressure"][()]
        # two runs, each with direct solves to rounding
        check(numpy.abs(p - q).max() <= 1e-9 * numpy.abs(p).max(), f"{corners}: another pressure")
        reactions = [file[f"{path}/reaction"][()].sum(axis=0) for file in (f, g)]
    check(numpy.abs(reactions[0] - reactions[1]).max() <= 1e-9 * numpy.abs(reactions[0]).max(), f"reactions {reactions}")
    edges = x[cells[:, 1:]] - x[cells[:, :1]]
    volume = numpy.abs(numpy.linalg.det(edges)) / 6
    sums, weights = numpy.zeros_like(x), numpy.zeros(len(x))
    for a in range(4):
        numpy.add.at(sums, cells[:, a], volume[:, None] * own[:, a])
        numpy.add.at(weights, cells[:, a], volume)
    worst = numpy.abs(sums / weights[:, None] - u).max() / numpy.abs(u).max()
    check(worst <= 1e-9, f"{mean}: a vertex differs by {worst:.2g} from the mean of the corners in {corners}")
    jump = numpy.abs(own - u[cells]).max() / numpy.abs(u).max()
    check(jump < 1e-9 if mean == "p21" else 1e-5 < jump < 0.2, f"{corners}: jumps of {jump:.2g} of the largest displacement")
    print(f"{corners}: jumps up to {jump:.2g} of the largest displacement")


def main():
    folders = []
    for ranks in (1, 2, 3, 4):
        folders.append(f"ranks{ranks}")
        run(ranks, folders[-1], "-output_precision", "double", "-quiet")
        check(check_frames(folders[-1]) == 21, f"{ranks} ranks: {check_frames(folders[-1])} frames, expected 21")
    # 20 steps with the linear solves to 1e-10
    check_ranks(folders, 1e-8)
    run(2, "float", "-quiet")
    # rounding to float, beside the difference of two runs
    check_ranks(["float", "ranks2"], 1e-7)
    here = os.getcwd()
    for make in readers():
        check_reader(make, "float", str(OUT / "float" / "fields.xmf"))
        os.chdir(OUT / "float")
        check_reader(make, "float", "./fields.xmf")
        os.chdir(here)
    check(check_vtkhdf("float")[1] >= {"points", "cells", "displacement", "stress", "body"}, "arrays of fields.vtkhdf")
    check_elements()
    # without the field position: the rest shape, with the sets
    still = ["-quiet", "-output_fields", "displacement,sets,rank", "-sets", "left,half", "-set_half_at", "halfspace:1,0,0,0.2"]
    run(2, "still", *still, "-ts_max_time", "0.04")
    check(check_vtkhdf("still")[1] >= {"points", "set_half", "tets_half", "rank"}, "sets in fields.vtkhdf")
    run(2, "p1-corners", "-quiet", "-output_discontinuous", "-ts_max_time", "0.04")
    check_reader(vtkXdmfReader, "p1-corners", str(OUT / "p1-corners" / "fields.xmf"))


if __name__ == "__main__":
    main()
