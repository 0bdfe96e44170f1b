"""fields.xmf and fields.vtkhdf in ParaView itself: each of its three XDMF readers, and from ParaView 5.12 on that of VTKHDF, gives the frames, times, names
and values of fields.h5; of P1, and of the other elements with points of their own for each cell.

@long
Needs pvpython, from PATH or named by PVPYTHON; on Debian: apt-get install --no-install-recommends python3-paraview
"""
import functools
import json
import os
import re
import shutil
import subprocess
import sys

import h5py
import numpy

from output_common import ELEMENTS, OUT, frames, history, run

READERS = {"XDMFReader": "fields.xmf", "Xdmf3ReaderT": "fields.xmf", "Xdmf3ReaderS": "fields.xmf", "VTKHDFReader": "fields.vtkhdf"}
POINTS = ["displacement", "velocity", "acceleration", "reaction"]
CELLS = ["stress", "von_mises", "J", "energy_density", "body"]

# Runs inside ParaView, which has no numpy here for certain: sums and one entry of each array are enough to compare.
INSIDE = """
import json, sys
from paraview import simple, servermanager

name, path, time = sys.argv[1], sys.argv[2], float(sys.argv[3])
make = getattr(simple, name)
reader = make(FileNames=[path]) if name == "XDMFReader" else make(FileName=path) if name == "VTKHDFReader" else make(FileName=[path])
reader.UpdatePipelineInformation()
times = list(reader.TimestepValues)
simple.UpdatePipeline(time=time, proxy=reader)
grid = servermanager.Fetch(reader)
while grid.IsA("vtkCompositeDataSet"):
    items = grid.NewIterator()
    items.InitTraversal()
    grid = items.GetCurrentDataObject()
arrays = {}
for data in (grid.GetPointData(), grid.GetCellData()):
    for k in range(data.GetNumberOfArrays()):
        a = data.GetArray(k)
        last = a.GetNumberOfTuples() - 1
        arrays[a.GetName()] = [a.GetNumberOfTuples(), a.GetNumberOfComponents(), list(a.GetTuple(0)), list(a.GetTuple(last))]
corner = [grid.GetCell(7).GetPointId(a) for a in range(4)]
print("RESULT" + json.dumps([times, grid.GetNumberOfPoints(), grid.GetNumberOfCells(), corner, list(grid.GetPoint(corner[2])), arrays]))
"""


def check(condition, text):
    if not condition:
        sys.exit(text)


def read(pvpython, reader, path, time):
    script = OUT / "inside.py"
    script.write_text(INSIDE)
    environment = dict(os.environ, QT_QPA_PLATFORM="offscreen")
    result = subprocess.run([pvpython, str(script), reader, str(path), str(time)], capture_output=True, text=True,
                            env=environment)
    lines = [line for line in result.stdout.splitlines() if line.startswith("RESULT")]
    check(result.returncode == 0 and lines, f"{reader}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return json.loads(lines[0][len("RESULT"):])


def check_array(reader, name, found, expected):
    """Length, first and last entry; a tensor may come full."""
    count, components, first, last = found
    rows = expected.reshape(len(expected), -1)
    check(count == len(rows), f"{reader}: {name} has {count} entries, expected {len(rows)}")
    if rows.shape[1] == 6 and components == 9:
        first, last = ([full[k] for k in (0, 1, 2, 4, 5, 8)] for full in (first, last))
    for got, row in ((first, rows[0]), (last, rows[-1])):
        check(numpy.array_equal(numpy.array(got, dtype=rows.dtype), row), f"{reader}: {name} holds {got}, expected {row}")


@functools.cache
def version(pvpython):
    """Of ParaView: (5, 11)."""
    text = subprocess.run([pvpython, "--version"], capture_output=True, text=True)
    return tuple(int(n) for n in re.search(r"(\d+)\.(\d+)", text.stdout + text.stderr).groups())


def check_readers(pvpython, folder, *options):
    run(2, folder, "-quiet", *options)
    names, rows = history(folder)
    time, group = frames(folder)[len(rows) // 2]
    with h5py.File(OUT / folder / "fields.h5", "r") as f:
        for reader, file in READERS.items():
            if reader == "VTKHDFReader" and version(pvpython) < (5, 12):
                print(f"{reader}: left out, steps of VTKHDF need ParaView 5.12, this is {version(pvpython)}")
                continue
            times, npoint, ncell, corner, point, arrays = read(pvpython, reader, OUT / folder / file, time)
            check(numpy.array_equal(times, rows[:, names.index("time")]), f"{reader}: times {times}")
            check(npoint == len(f["/mesh/x"]) and ncell == len(f["/mesh/cells"]), f"{reader}: {npoint} points, {ncell} cells")
            check(corner == list(f["/mesh/cells"][7][:4]), f"{reader}: cell 7 {corner}")
            places = f["/mesh/x"] if file == "fields.xmf" else f[f"{group}/position"]
            check(point == list(places[corner[2]]), f"{reader}: cell 7 {corner} {point}")
            for name in POINTS + CELLS:
                check(name in arrays, f"{reader}: {name} is missing among {list(arrays)}")
                expected = f["/mesh/body" if name == "body" else f"{group}/{name}"][()]
                if name == "stress" and file == "fields.vtkhdf":
                    expected = expected[:, [0, 3, 5, 1, 4, 2]]
                check_array(reader, name, arrays[name], expected)
            print(f"{reader}: {len(times)} frames, {len(arrays)} arrays, {npoint} points of {folder}")


def main():
    pvpython = os.environ.get("PVPYTHON") or shutil.which("pvpython")
    check(pvpython, "pvpython is missing: apt-get install --no-install-recommends python3-paraview, or name it by PVPYTHON")
    check_readers(pvpython, "run")
    for element in ("cr", "dg", "mixed"):
        check_readers(pvpython, element, *ELEMENTS[element], "-output_discontinuous", "-ts_max_time", "0.04")
    check_readers(pvpython, "quadratic", "-body_bar_element", "p2", "-output_quadratic", "-ts_max_time", "0.04")


if __name__ == "__main__":
    main()
