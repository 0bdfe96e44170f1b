"""Grids in pieces as VTK writes them, in one file and in a .pvtu, with and without ghost cells, in all formats of data: the same mesh.

Numbers of points, and directions of fibres: tests/unit/test_mesh_variants.c, test_fibre_field.c.

@cpu 60
"""
import itertools
import os
import re
import subprocess
import sys
from pathlib import Path

try:
    import numpy as np
    import vtk
    from vtkmodules.util.numpy_support import numpy_to_vtk
except ImportError:
    print("needs vtk: scripts/venv makes .venv")
    sys.exit(77)

OUT = Path(os.environ["SB_OUT"])
TOOL = Path(os.environ["SB_SUPPLE"]).with_name("supple-mesh")
N, PIECES = 4, 5
passed = failed = 0


def check(what: str, good: bool, text: str = "") -> None:
    global passed, failed
    passed, failed = passed + good, failed + (not good)
    if not good:
        print(f"FAIL {what}: {text}")


def cube() -> vtk.vtkUnstructuredGrid:
    """6 N^3 tets in a cube, whose vertices are no binary fractions; two regions."""
    points, grid = vtk.vtkPoints(), vtk.vtkUnstructuredGrid()
    points.SetDataTypeToFloat()
    for corner in itertools.product(range(N + 1), repeat=3):
        points.InsertNextPoint([c / (3. * N) for c in corner])
    grid.SetPoints(points)
    regions = []
    for cell in itertools.product(range(N), repeat=3):
        for order in itertools.permutations(range(3)):
            at, tet = list(cell), []
            for axis in (None, *order):
                if axis is not None:
                    at[axis] += 1
                tet.append((at[0] * (N + 1) + at[1]) * (N + 1) + at[2])
            grid.InsertNextCell(vtk.VTK_TETRA, 4, tet)
            regions.append(1 + (cell[0] >= N // 2))
    array = numpy_to_vtk(np.array(regions, dtype=np.int32), deep=1)
    array.SetName("region")
    grid.GetCellData().AddArray(array)
    return grid


def write(kind: str, grid: vtk.vtkUnstructuredGrid, mode: str, ghosts: int) -> Path:
    cut = vtk.vtkExtractUnstructuredGridPiece()
    cut.SetInputData(grid)
    cut.SetCreateGhostCells(1)
    path = OUT / f"{mode}{ghosts}.{kind}"
    writer = vtk.vtkXMLPUnstructuredGridWriter() if kind == "pvtu" else vtk.vtkXMLUnstructuredGridWriter()
    writer.SetInputConnection(cut.GetOutputPort())
    writer.SetNumberOfPieces(PIECES)
    if kind == "pvtu":
        writer.SetStartPiece(0)
        writer.SetEndPiece(PIECES - 1)
    writer.SetGhostLevel(ghosts)
    getattr(writer, f"SetDataModeTo{mode}")()
    if mode == "Binary":
        writer.SetCompressorTypeToNone()
    writer.SetFileName(str(path))
    check(f"{path.name} is written", writer.Write() == 1)
    return path


def facts(path: Path) -> tuple[list[str], str]:
    """Lines of `info` about vertices, tets, regions, facets and edges, and its line of remarks."""
    done = subprocess.run([TOOL, "info", path], capture_output=True, text=True, check=False, timeout=100)
    lines = (done.stdout + done.stderr).splitlines()
    return [" ".join(line.split()) for line in lines if re.search("vertices|tets|volume|surface|parts|edges|error", line) and "to know" not in line], \
        next((line for line in lines if "to know" in line), "")


GRID = cube()
one = vtk.vtkXMLUnstructuredGridWriter()
one.SetInputData(GRID)
one.SetFileName(str(OUT / "one.vtu"))
one.Write()
WANTED = facts(OUT / "one.vtu")[0]
check("one piece", any(f"tets {6 * N**3}" in line for line in WANTED), str(WANTED))
for kind, mode, ghosts in itertools.product(("vtu", "pvtu"), ("Ascii", "Binary", "Appended"), (0, 1)):
    got, remark = facts(write(kind, GRID, mode, ghosts))
    check(f"{mode}{ghosts}.{kind}", got == WANTED, f"{got} instead of {WANTED}")
    check(f"remark on {mode}{ghosts}.{kind}", f"{PIECES} pieces, " in remark and ("ghost cells" in remark) == (ghosts > 0), remark)

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
