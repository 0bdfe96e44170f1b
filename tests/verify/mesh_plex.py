"""The mesh as a DMPLEX, seen from a run: PETSc's viewers, partitioners, and ranks without cells.

@cpu 120
"""
import csv
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy

OUT = Path(os.environ["SB_OUT"])
SUPPLE = os.environ["SB_SUPPLE"]
MPI = os.environ["SB_MPI"].split()
passed = failed = 0


def check(holds: bool, what: str) -> None:
    """Counts a check; says which one failed."""
    global passed, failed
    passed, failed = passed + bool(holds), failed + (not holds)
    if not holds:
        print("FAILED:", what)


def run(name: str, ranks: int, *options: str) -> tuple[str, dict[str, float]]:
    """Output of a bar that starts to bend under its weight, and the last row of its history."""
    folder = OUT / name
    done = subprocess.run(
        [*MPI, str(ranks), SUPPLE, "-bodies", "bar", "-body_bar_material", "corotated", "-body_bar_young", "1e4",
         "-body_bar_poisson", "0.3", "-body_bar_density", "1000", "-effects", "gravity,clamp", "-effect_clamp_type",
         "fixed", "-effect_clamp_on", "xmin", "-ts_dt", "0.01", "-ts_max_time", "0.02", "-snes_rtol", "1e-10",
         "-ksp_rtol", "1e-10", "-validate", "-output_dir", str(folder), *options],
        capture_output=True, text=True, check=False)
    if done.returncode:
        return done.stdout + done.stderr, {}
    with open(folder / "history.csv", encoding="utf-8") as file:
        row = list(csv.DictReader(file))[-1]
    return done.stdout + done.stderr, {key: float(value) for key, value in row.items() if value}


def same(one: dict[str, float], other: dict[str, float]) -> bool:
    """Whether two runs ended with the same energies and displacements."""
    keys = ("kinetic", "strain", "max_displacement")
    return bool(one and other) and all(abs(one[k] - other[k]) <= 1e-6 * abs(one[k]) for k in keys)


# More ranks than tets: some have none. All elements, one body; and P2 beside CR.
for element in ("p1", "p2", "cr", "dg"):
    options = ("-body_bar_mesh", "box:0.1,0.1,0.1:1", "-body_bar_element", element)
    text, alone = run(f"{element}_1", 1, *options)
    text, many = run(f"{element}_7", 7, *options)
    check(same(alone, many), f"{element} with six tets on seven ranks: {alone.get('strain')}, {many.get('strain')}\n{text[-800:]}")

# Partitioners of supple and of PETSc: the same motion.
mesh = ("-body_bar_mesh", "box:0.4,0.1,0.1:2", "-body_bar_element", "cr")
_, alone = run("alone", 1, *mesh)
packages = os.environ.get("SB_PACKAGES", "").split(",")
for kind in ("metis", "bisection", "simple", "gather", *(["ptscotch"] if "ptscotch" in packages else [])):
    text, parts = run(kind, 3, *mesh, "-petscpartitioner_type", kind, "-dm_view")
    check(same(alone, parts), f"-petscpartitioner_type {kind}: other results than on one rank\n{text[-800:]}")
    check("type: plex" in text and "boundary:" in text, f"{kind}: -dm_view shows no DMPLEX with labels")
for kind, more, words in (
    ("metiss", (), ("metiss", "metis?")),
    ("shell", (), ("shell",)),
    ("bisection", ("-petscpartitioner_view_graph",), ("-petscpartitioner_view_graph", "bisection")),
    ("simple", ("-petscpartitioner_simple_node_grid", "1,1,1"), ("-petscpartitioner_type simple",)),
    ("metis", ("-petscpartitioner_use_vertex_weights",), ("-petscpartitioner_use_vertex_weights",)),
):
    text, none = run(f"bad_{kind}", 3, *mesh, "-petscpartitioner_type", kind, *more)
    lines = [line for line in text.splitlines() if "error" in line.lower()]
    check(not none and len(lines) == 1 and all(w in lines[0] for w in words), f"-petscpartitioner_type {kind}: {lines}")

# PETSc's viewers of the mesh and of the displacements.
for element, nodes in (("p1", "vertices"), ("p2", "vertices and edges"), ("cr", "faces")):
    plex, field = OUT / f"{element}.plex.h5", OUT / f"{element}.u.h5"
    text, row = run(f"view_{element}", 2, "-body_bar_mesh", "box:0.4,0.1,0.1:2", "-body_bar_element", element, "-dm_view",
                    f"hdf5:{plex}", "-displacement_view", f"hdf5:{field}")
    check(bool(row), f"{element}: viewers\n{text[-800:]}")
    if not row:
        continue
    with h5py.File(plex) as file:
        found: list[str] = []
        file.visit(found.append)
        check(any("labels" in name for name in found), f"{element}: {plex.name} has no labels")
    with h5py.File(field) as file:
        u = numpy.array(file["fields/displacement"]).reshape(-1, 3)
    largest = float(numpy.linalg.norm(u, axis=1).max())
    check(abs(largest - row["max_displacement"]) <= 0.05 * largest,
          f"{element}: displacements of {nodes} up to {largest}, {row['max_displacement']} in the history")
text, none = run("view_vtk_cr", 1, *mesh, "-displacement_view", f"vtk:{OUT}/cr.vtu")
check(not none and "-displacement_view" in text, "cr has no place in VTK files, and this is not said")

# Viewers that cannot be had: one line that names the option.
for option, value in (
    ("-dm_view", "draw"),
    ("-dm_view", "nonsense"),
    ("-dm_view", f"hdf5:{OUT}/none/a.h5"),
    ("-dm_view", f"vtk:{OUT}/none/a.vtu"),
    ("-displacement_view", f"hdf5:{OUT}/none/a.h5"),
    ("-ksp_view", f"hdf5:{OUT}/none/a.h5"),
):
    text, _ = run("view_bad", 2, *mesh, option, value)
    lines = [line for line in text.splitlines() if "supple: error" in line or "PETSC ERROR" in line]
    check(len(lines) == 1 and f"{option} {value}" in lines[0], f"{option} {value}: {lines[:4]}")

# The file of -displacement_view is tried before anything is computed, and one that is there is left as it is.
kept = OUT / "kept"
kept.mkdir(exist_ok=True)
for value in (f"hdf5:{OUT}/none/a.h5", f"hdf5:{kept}", "nonsense:a"):
    text, _ = run("view_early", 2, *mesh, "-displacement_view", value)
    check(f"-displacement_view {value}" in text and "kinetic" not in text, f"-displacement_view {value}: {text[-300:]}")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
