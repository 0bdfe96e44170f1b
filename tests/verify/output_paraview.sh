#!/usr/bin/env bash
# fields.xmf as ParaView's own reader reads it: frames, times, fields, and the largest displacement against history.csv.
# @long
# @timeout 300
set -euo pipefail
read -ra mpi <<<"$SB_MPI"
"${mpi[@]}" 2 "$SB_SUPPLE" scenarios/swing.opts -ts_max_time 0.2 -output_precision double -output_dir "$SB_OUT/swing" >/dev/null
cat >"$SB_OUT/read.py" <<'PYTHON'
import csv
import sys

from paraview.simple import Xdmf3ReaderS
from vtkmodules.util.numpy_support import vtk_to_numpy
import paraview.servermanager

folder = sys.argv[1]
reader = Xdmf3ReaderS(FileName=[folder + "/fields.xmf"])
reader.UpdatePipelineInformation()
times = list(reader.TimestepValues)
with open(folder + "/history.csv") as f:
    rows = list(csv.DictReader(line for line in f if not line.startswith("#")))
history = {round(float(r["time"]), 9): float(r["max_displacement"]) for r in rows}
assert len(times) == 5 and abs(times[-1] - 0.2) < 1e-12, times
# The reader knows the names of the arrays after its first update only.
reader.UpdatePipeline(times[-1])
for t in times:
    reader.UpdatePipeline(t)
    grid = paraview.servermanager.Fetch(reader)
    u = vtk_to_numpy(grid.GetPointData().GetArray("displacement"))
    largest = (u**2).sum(axis=1).max() ** 0.5
    assert abs(largest - history[round(t, 9)]) <= 1e-12, (t, largest, history[round(t, 9)])
    assert grid.GetCellData().GetArray("von_mises").GetNumberOfTuples() == grid.GetNumberOfCells() > 0
print("ParaView reads", len(times), "frames")
PYTHON
env -u PYTHONPATH pvpython "$SB_OUT/read.py" "$SB_OUT/swing" 2>&1 | tail -n 5 | tee "$SB_OUT/paraview.txt"
grep -q "ParaView reads 5 frames" "$SB_OUT/paraview.txt"
