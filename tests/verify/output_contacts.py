"""contacts.xmf and contacts.vtkhdf: the places of contact as VTK reads them, frame by frame, against fields.h5 and the pairs in history.csv; a frame
without any; going on after a restart, with the places and without; what is refused.
"""
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import h5py
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

from output_common import MPI, OUT, SUPPLE, frames, history, vtkhdf

PAIRS = os.path.abspath("tests/scenario/pairs.opts")
EMPTY = {"force": 0, "normal": 0, "gap": 0, "normal_force": 0, "friction_force": 0, "body": -1, "other": -1, "effect": -1}


def check(condition, text):
    if not condition:
        sys.exit(text)


def run(ranks, folder, *more, fails=False):
    command = [*MPI, str(ranks), SUPPLE, PAIRS, "-output_dir", str(OUT / folder), "-quiet", *more]
    result = subprocess.run(command, capture_output=True, text=True)
    check((result.returncode != 0) == fails, f"{folder}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout + result.stderr


def times_of(folder):
    grids = ElementTree.parse(OUT / folder / "contacts.xmf").getroot().iter("Time")
    return [float(time.get("Value")) for time in grids]


def places(folder, group):
    with h5py.File(OUT / folder / "fields.h5", "r") as f:
        found = f[f"{group}/contacts"]
        return int(found.attrs["count"]), {name: data[()] for name, data in found.items()}


def check_seconds(folder):
    """Contact and its linear solves have their own seconds: more than the residuals of the same iterations."""
    seconds = json.loads((OUT / folder / "run.json").read_text())["seconds"]
    check(seconds["contact"] > 0, f"{folder}: no seconds of contact: {seconds}")
    check(seconds["linear solve"] > seconds["residual"], f"{folder}: solves with contact are not counted: {seconds}")


def check_reader(folder):
    """What the reader finds in each frame; the first one has no contact."""
    reader = vtkXdmfReader()
    reader.SetFileName(str(OUT / folder / "contacts.xmf"))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    listed = frames(folder)
    check(list(times) == [time for time, _ in listed], f"times {times}, frames at {listed}")
    for time, group in listed:
        count, data = places(folder, group)
        reader.UpdateTimeStep(time)
        grid = reader.GetOutputDataObject(0)
        while grid.IsA("vtkMultiBlockDataSet"):
            grid = grid.GetBlock(0)
        n = grid.GetNumberOfPoints()
        check(n == max(count, 1) and grid.GetNumberOfCells() == n and grid.GetCellType(0) == 2, f"{n} points for {count} places")
        for name, none in EMPTY.items():
            values = vtk_to_numpy(grid.GetPointData().GetArray(name))
            check(numpy.array_equal(values, data[name]) if count else (values == none).all(), f"t = {time}: {name}")
        if count:
            check(numpy.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), data["x"]), f"t = {time}: places")
    # the same in contacts.vtkhdf, which has no point where there is none
    steps = list(vtkhdf(OUT / folder / "contacts.vtkhdf"))
    check([time for time, _ in steps] == list(times), f"contacts.vtkhdf: times {[time for time, _ in steps]}")
    for (time, grid), (_, group) in zip(steps, listed):
        count, data = places(folder, group)
        check(grid.IsA("vtkPolyData") and grid.GetNumberOfPoints() == grid.GetNumberOfVerts() == count, f"t = {time}: {count} places")
        check(all(grid.GetCell(c).GetPointId(0) == c for c in range(count)), f"t = {time}: vertices")
        for name in EMPTY if count else ():
            check(numpy.array_equal(vtk_to_numpy(grid.GetPointData().GetArray(name)), data[name]), f"contacts.vtkhdf, t = {time}: {name}")
        check(not count or numpy.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), data["x"]), f"contacts.vtkhdf, t = {time}: places")
    check(places(folder, listed[0][1])[0] == 0 and count > 20, f"the first frame has places, or the last one only {count}")


def check_numbers(folder):
    """The last frame: sums by bodies as in the history, places at the surfaces that meet, forces along the normals."""
    _, data = places(folder, frames(folder)[-1][1])
    names, rows = history(folder)
    last = dict(zip(names, rows[-1]))
    meet = data["effect"] == 2  # third of -effects
    for number, (a, b) in {(0, 1): "ab", (0, 2): "ac", (1, 2): "bc"}.items():
        on, back = (meet & (data["body"] == p) & (data["other"] == q) for p, q in (reversed(number), number))
        total = data["force"][on].sum(axis=0) - data["force"][back].sum(axis=0)
        told = [last[f"meet_{a}_{b}_force_{c}"] for c in "xyz"]
        # single precision in the file
        check(numpy.abs(total - told).max() <= 1e-5, f"{a} and {b}: {total} in fields.h5, {told} in history.csv")
        check((on | back).sum() >= last[f"meet_{a}_{b}_contacts"], f"{a} and {b}: {(on | back).sum()} places")
        top = 0.1 if b == "c" else 0.06
        check(numpy.abs(data["x"][on | back][:, 2] - top).max(initial=0) < 1e-3, f"{a} and {b}: places off z = {top}")
    floor = data["effect"] == 1
    check((data["other"][floor] == -1).all() and (data["body"][floor] == 0).all(), "the floor pushes another body than a")
    check(abs(data["force"][floor, 2].sum() - last["floor_force_z"]) <= 1e-5, "force of the floor")
    check(numpy.abs(data["normal"][floor] - [0, 0, 1]).max() < 1e-6, "normal of the floor")
    whole = data["normal_force"][:, None] * data["normal"] + data["friction_force"]
    check(numpy.abs(whole - data["force"]).max() < 1e-6, "parts of the forces")
    # forces of edges that are nearly parallel lean a little
    check(abs(data["normal_force"][meet].sum() - last["meet_normal_force"]) <= 0.01 * last["meet_normal_force"], "normal forces")


def check_restart():
    """Half a run, and on from there: the same frames as in one; without the option those up to there stay."""
    whole = times_of("two")
    for folder, option, expected in (("again", [], whole), ("without", ["-output_contacts", "no"], whole[:2])):
        run(2, folder, "-ts_max_time", "0.14", "-checkpoint_every_time", "0.1")
        check(len(times_of(folder)) == 3, f"{folder}: frames at {times_of(folder)} before")
        run(2, folder, "-restart", str(min((OUT / folder).glob("checkpoint_*.h5"))), *option)
        # one run and two round differently at most
        check(numpy.allclose(times_of(folder), expected, rtol=0, atol=1e-12), f"{folder}: frames at {times_of(folder)}, expected {expected}")
    run(1, "again", "-output_contacts", "no")
    check(not (OUT / "again" / "contacts.xmf").exists(), "contacts.xmf of an earlier run is left")


def main():
    run(1, "one")
    check_seconds("one")
    check_reader("one")
    check_numbers("one")
    run(2, "two")
    check_reader("two")
    check_numbers("two")
    check_restart()
    text = run(1, "refused", "-output_fields", "none", fails=True)
    check("-output_contacts yes needs frames" in text, text)


if __name__ == "__main__":
    main()
