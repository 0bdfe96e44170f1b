"""More ranks than tets: one to six tets on three to seven ranks give what they give on one.

Each row of the table below is a scene, run on one rank and on more than it has tets of a body: every element, effect, response of
contact, kind of output, integrator, solver, and restart, re-meshing and the ledger at least once. A run that hangs uses up its
processor time, one that waits without computing the test's.

@cpu 240
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
PACKAGES = os.environ.get("SB_PACKAGES", "").split(",")
passed = failed = 0

# One tet, and two that share a face.
TETS = {1: [(1, 2, 3, 4)], 2: [(1, 2, 3, 4), (2, 3, 4, 5)]}
for count, cells in TETS.items():
    points = ["0 0 0", "0.1 0 0", "0 0.1 0", "0 0 0.1", "0.1 0.1 0.1"][: 3 + count]
    (OUT / f"{count}.mesh").write_text(
        "MeshVersionFormatted 2\nDimension 3\nVertices " + str(len(points)) + "\n" + "".join(f"{p} 0\n" for p in points)
        + f"Tetrahedra {len(cells)}\n" + "".join(" ".join(map(str, c)) + " 0\n" for c in cells) + "End\n", encoding="utf-8")
MESH = {1: f"{OUT}/1.mesh", 2: f"{OUT}/2.mesh", 6: "box:0.1,0.1,0.1:1"}


def check(holds: bool, what: str) -> None:
    """Counts a check; says which one failed."""
    global passed, failed
    passed, failed = passed + bool(holds), failed + (not holds)
    if not holds:
        print("FAILED:", what, flush=True)


def body(name: str, tets: int, element: str = "p1", more: str = "") -> str:
    """Options of a body."""
    return (f"-body_{name}_mesh {MESH[tets]} -body_{name}_element {element} -body_{name}_young 1e4 -body_{name}_poisson 0.3 "
            f"-body_{name}_density 1000 " + (more if "_material" in more else f"-body_{name}_material corotated {more}"))


def run(folder: Path, ranks: int, options: str) -> tuple[int, str]:
    """Exit code and output of a run."""
    done = subprocess.run([*MPI, str(ranks), SUPPLE, *options.split(), "-output_dir", str(folder), "-validate", "-malloc_dump"],
                          capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def last(folder: Path) -> dict[str, float]:
    """The last row of a history; columns that do not depend on the ranks."""
    with open(folder / "history.csv", encoding="utf-8") as file:
        row = list(csv.DictReader(file))[-1]
    costs = ("wall", "second", "newton", "linear", "iteration", "rejected", "memory", "lag", "ratio", "remesh_m", "loss", "total")
    return {k: float(v) for k, v in row.items() if v and not any(c in k for c in costs)}


def same(one: dict[str, float], other: dict[str, float], rel: float) -> str:
    """The first column that differs; sizes of columns of a kind: energies by the largest of them, others by their own."""
    energy = max(abs(one[k]) for k in ("kinetic", "strain") if k in one)
    for key in one:
        size = energy if key in ("kinetic", "strain", "load_work", "prescribed_work") else abs(one[key])
        if size == energy and key not in ("kinetic", "strain") and energy < 1e-12:
            size = abs(one[key])
        if key not in other or abs(one[key] - other[key]) > rel * size + 1e-9 * (1 + size):
            return f"{key}: {one[key]} on one rank, {other.get(key)}"
    return "" if len(one) == len(other) else "other columns"


TIGHT = "-snes_rtol 1e-10 -ksp_rtol 1e-10 -ts_dt 0.01 -ts_max_time 0.03"
CLAMP = "-effect_clamp_type fixed -effect_clamp_on foot -sets foot,tip -set_foot_at halfspace:0,0,1,0.001 -set_tip_at halfspace:0,0,-1,-0.09"
HANG = f"-effects gravity,clamp {CLAMP}"
FLOOR = "-effects gravity,floor -effect_floor_type contact -effect_floor_obstacle plane:0,0,1,-0.0001"
STACK = ("-bodies a,b -body_b_translate 0.01,0.013,0.1002 -effects gravity,clamp,meet -effect_clamp_type fixed -effect_clamp_on a.zmin "
         "-effect_meet_type contact -effect_meet_friction 0.2")
PROBES = ("-probes p,q,r -probe_p_at 0.09,0.01,0.01 -probe_p_fields displacement,velocity,von_mises -probe_q_on a -probe_q_fields "
          "position,stress -probe_r_in a -probe_r_fields pressure,J,energy_density")

# name, ranks, options
CASES: list[tuple[str, int, str]] = []
for i, element in enumerate(("p1", "p2", "cr", "dg")):
    for tets, ranks in ((1, 3), (2, 3 + i), (6, 7)):
        CASES.append((f"{element}_{tets}", ranks, f"-bodies a {body('a', tets, element)} {HANG} {TIGHT}"))
    CASES.append((f"static_{element}", 7, f"-bodies a {body('a', 6, element)} {HANG} {TIGHT} -time static -effect_clamp_on foot,xmin"))
    CASES.append((f"free_{element}", 3, f"-bodies a {body('a', 1, element)} -effects gravity {TIGHT} -body_a_angular_velocity 0,0,9"))
for law in ("linear", "stvk", "stable_neohookean"):
    CASES.append((law, 3, f"-bodies a {body('a', 2, 'p1', f'-body_a_material {law}')} {HANG} {TIGHT}"))

# Effects.
EFFECTS = {
    "body_force": "-effect_x_density 0;100*x;-10",
    "traction": "-effect_x_on zmax -effect_x_vector 1;0;-5*t",
    "pressure": "-effect_x_on boundary -effect_x_value 100",
    "point_force": "-effect_x_on zmax -effect_x_vector 0.01;0;0",
    "prescribed_displacement": "-effect_x_on tip -effect_x_displacement t;0;0",
    "damping": "-effect_x_alpha 1 -effect_x_beta 0.01",
}
for i, (effect, options) in enumerate(EFFECTS.items()):
    for element in ("p1", "p2", "cr", "dg")[i % 2::2]:
        CASES.append((f"{effect}_{element}", 3 + i % 3, f"-bodies a {body('a', 6, element)} "
                      f"{HANG.replace('clamp ', 'clamp,x ', 1)} -effect_x_type {effect} {options} {TIGHT} -ts_max_time 0.02"))
CASES.append(("open_pressure", 4, f"-bodies a {body('a', 6)} {HANG.replace('clamp ', 'clamp,x ', 1)} -effect_x_type pressure "
              f"-effect_x_on tip -effect_x_value 100 {TIGHT}"))

# Contact with an obstacle, between bodies of one and two tets, and self-contact.
for i, response in enumerate(("projected", "multiplier", "augmented", "penalty", "barrier")):
    element = ("p1", "p2", "cr", "dg")[i % 4]
    CASES.append((f"floor_{response}", 3 + i, f"-bodies a {body('a', 1 + i % 2, element)} {FLOOR} -effect_floor_friction 0.3 "
                  f"-effect_floor_response {response} {TIGHT}"))
    CASES.append((f"stack_{response}", 3 + i, f"{body('a', 6, ('p1', 'p2', 'cr', 'p1', 'dg')[i])} {body('b', 1 + i % 2)} {STACK} "
                  f"-effect_meet_response {response} {TIGHT} -snes_rtol 1e-8"))
CASES.append(("bounce", 5, f"-bodies a {body('a', 1)} {FLOOR} -effect_floor_restitution 0.5 -body_a_velocity 0;0;-0.1 {TIGHT}"))
CASES.append(("mesh_floor", 3, f"-bodies a {body('a', 2)} {FLOOR.replace('plane:0,0,1,-0.0001', 'box:-1,-1,-1,1,1,-0.0001')} {TIGHT}"))
CASES.append(("self", 5, f"-bodies a {body('a', 2)} {HANG.replace('clamp ', 'clamp,s ', 1)} -effect_s_type contact -effect_s_self yes {TIGHT}"))
CASES.append(("overlapping", 6, f"{body('a', 6)} {body('b', 1)} {STACK} -body_b_translate 0,0,0.09 {TIGHT} -effect_meet_friction 0"))

# Integrators, solvers.
for i, time in enumerate(("newmark", "genalpha", "euler_symplectic", "euler_explicit", "alpha2")):
    small = "-ts_dt 1e-4 -ts_max_time 3e-4" if time.startswith("euler_") else ""
    CASES.append((time, 3 + i, f"-bodies a {body('a', 1 + i % 2, ('p1', 'cr', 'p2', 'dg', 'p1')[i])} {HANG} {TIGHT} -time {time} {small}"))
CASES.append(("arc_length", 4, f"-bodies a {body('a', 2)} {HANG} {TIGHT} -time static -static_control arc_length"))
SOLVERS = {"cg": "p1", "cg_jacobi": "cr", "cg_pbjacobi": "p1", "cg_icc": "p2", "cg_ssor": "p1", "cg_two_level": "p1",
           "cg_p_multigrid": "p2", "cg_gamg": "p1", "gauss_seidel": "p1", "sor": "cr", "rotated": "p1", "realtime": "p1",
           "pressure": "cr", "direct": "dg", "cholmod": "p1", "umfpack": "p1"}
SOLVERS |= {k: v for k, v in (("cg_hypre", "p1"), ("mumps", "p2")) if k.removeprefix("cg_") in PACKAGES}
for i, (solver, element) in enumerate(SOLVERS.items()):
    CASES.append((f"solver_{solver}", 3 if i % 2 else 7, f"-bodies a {body('a', 2 if i % 2 else 6, element)} {HANG} {TIGHT} "
                  f"-solver {solver} -ksp_rtol 1e-7 -snes_rtol 1e-6 -ts_max_time 0.02 "
                  + ("-body_a_tangent warped" if solver == "realtime" else "")))
CASES.append(("pressure_p2", 7, f"-bodies a {body('a', 6, 'p2', '-body_a_poisson 0.4999')} {HANG} {TIGHT} -solver pressure"))
CASES.append(("pressure_dg", 3, f"-bodies a {body('a', 2, 'dg', '-body_a_poisson 0.4999')} {HANG} {TIGHT} -solver pressure"))

# Output, ledger, accuracy, re-meshing, copies, inclusions.
ALL = ("-output_fields position,displacement,velocity,acceleration,reaction,stress,von_mises,pressure,mean_pressure,J,energy_density,"
       "sets -output_precision double -output_history_bodies")
for element in ("p1", "p2", "cr", "dg"):
    CASES.append((f"output_{element}", 5, f"-bodies a {body('a', 2, element)} {HANG} {TIGHT} {ALL} {PROBES} "
                  + {"p1": "", "p2": "-output_quadratic"}.get(element, "-output_discontinuous")))
CASES.append(("output_contact", 7, f"{body('a', 6)} {body('b', 1)} {STACK} {TIGHT} -output_contacts "
              "-output_fields position,contact_force,contact_gap"))
CASES.append(("ledger", 4, f"-bodies a {body('a', 2)} {HANG} {TIGHT} -ledger"))
CASES.append(("ledger_static", 7, f"-bodies a {body('a', 6)} {HANG} {TIGHT} -time static -ledger -ledger_quantity displacement "
              "-ledger_at 0.1,0.1,0.1 -ledger_direction 0,0,1"))
CASES.append(("ledger_contact", 5, f"-bodies a {body('a', 1)} {FLOOR} {TIGHT} -ledger"))
CASES.append(("accuracy", 4, f"-bodies a {body('a', 2)} {HANG} {TIGHT} -accuracy 0.1 -ledger"))
CASES.append(("remesh", 7, f"-bodies a {body('a', 6)} {HANG} {TIGHT} -remesh_times 0.01 -remesh_size 2"))
CASES.append(("remesh_rest_p2", 5, f"-bodies a {body('a', 6, 'p2')} {HANG} {TIGHT} -remesh_times 0.01 -remesh_from rest -remesh_size 2"))
CASES.append(("copies", 7, f"-bodies a {body('a', 1, 'p1', '-body_a_copies grid:2,1,1,0.2,0,0')} {HANG} {TIGHT}"))
CASES.append(("mixed", 7, f"-bodies a,b {body('a', 1, 'p2')} {body('b', 2, 'cr', '-body_b_translate 1,0,0')} {HANG} {TIGHT}"))
CASES.append(("consistent", 3, f"-bodies a {body('a', 1)} {HANG} {TIGHT} -mass consistent"))

LOOSE = {"remesh": 1e-4, "remesh_rest_p2": 1e-4, "accuracy": 1e-3, "overlapping": 1e-3}
only = sys.argv[1:]
for name, ranks, options in CASES:
    if only and name not in only:
        continue
    text = ["", ""]
    codes = [0, 0]
    for k, n in enumerate((1, ranks)):
        codes[k], text[k] = run(OUT / f"{name}_on_{n}", n, options)
    if codes != [0, 0]:
        check(False, f"{name}: {options}\n  on one rank {codes[0]}: {text[0][-600:]}\n  on {ranks} ranks {codes[1]}: {text[1][-1200:]}")
        continue
    odd = same(last(OUT / f"{name}_on_1"), last(OUT / f"{name}_on_{ranks}"), LOOSE.get(name, 1e-5))
    check(not odd, f"{name} on {ranks} ranks: {odd}")
    check("nobody read" not in text[1], f"{name}: {text[1][-500:]}")
    if name.startswith("output_"):
        fields = []
        for n in (1, ranks):
            with h5py.File(OUT / f"{name}_on_{n}" / "fields.h5") as file:
                found: dict[str, numpy.ndarray] = {}
                file.visititems(lambda key, item, to=found: to.update({key: item[()]}) if isinstance(item, h5py.Dataset) else None)
                fields.append(found)
        check(fields[0].keys() == fields[1].keys(), f"{name}: other arrays {fields[0].keys() ^ fields[1].keys()}")
        for key in fields[0].keys() & fields[1].keys():
            a, b = fields[0][key], fields[1][key]
            near = a.shape == b.shape and (a.dtype.kind not in "fiu" or
                                           numpy.allclose(a, b, rtol=1e-5, atol=1e-6 * max(abs(a).max(), 1e-12) if a.size else 0))
            check(near, f"{name}: {key} differs")

# A checkpoint of many ranks goes on with one, and the other way round.
for element, tets in (("p1", 1), ("p2", 2), ("dg", 2)):
    if only:
        break
    scene = f"-bodies a {body('a', tets, element)} {HANG} {TIGHT} -checkpoint_every_steps 1"
    ends = []
    for first, second in ((1, 5), (5, 1)):
        folder = OUT / f"restart_{element}_{first}"
        code, text = run(folder, first, f"{scene} -ts_max_time 0.02")
        check(not code, f"restart, {element}, first part on {first}: {text[-800:]}")
        code, text = run(folder, second, f"{scene} -ts_max_time 0.04 -restart latest")
        check(not code, f"restart, {element}, {first} to {second} ranks: {text[-800:]}")
        ends.append(last(folder) if not code else {})
    check(all(ends) and not same(ends[0], ends[1], 1e-6), f"restart, {element}: {same(ends[0], ends[1], 1e-6) if all(ends) else ''}")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
