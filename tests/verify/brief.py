"""What the program was asked to be: the table of docs/architecture.md, row by row, by what the
program does when it runs.

Each row has a function here that runs the program and looks at what came of it: views of PETSc's
objects, columns of the history, files, log events, and the functions of libraries that were called
(the dynamic linker tells them when LD_DEBUG asks). A row without a function, a function without a
row, a place that is not there, and a sentence of NOT_YET that the table does not repeat are
failures, too; and the program must still refuse what the table says it cannot do.

@cpu 200
"""
import csv
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy
import PIL.Image

TOP = Path(__file__).resolve().parents[2]
OUT = Path(os.environ.get("SB_OUT", "build/test-out/brief")).resolve()
BUILD = Path(os.environ.get("SB_BUILD", "build")).resolve()
SUPPLE = Path(os.environ.get("SB_SUPPLE", "bin/supple")).resolve()
SUPPLE_MESH = SUPPLE.with_name("supple-mesh")
LAUNCHER, *FLAGS = shlex.split(os.environ.get("SB_MPI", "scripts/mpi"))
MPI = [str(Path(LAUNCHER).resolve()) if "/" in LAUNCHER else LAUNCHER, *FLAGS]

# A bar that sags.
BAR = {
    "bodies": "bar",
    "body_bar_mesh": "box:0.4,0.1,0.1:4,1,1",
    "body_bar_material": "corotated",
    "body_bar_young": "5e4",
    "body_bar_poisson": "0.3",
    "body_bar_density": "1000",
    "effects": "gravity,hold",
    "effect_hold_type": "fixed",
    "effect_hold_on": "xmin",
    "time": "euler_implicit",
    "ts_dt": "0.01",
    "ts_max_time": "0.02",
    "output_fields": "none",
}

# A cube that slides on a floor.
CUBE = BAR | {
    "body_bar_mesh": "box:0.1,0.1,0.1:2",
    "body_bar_translate": "0,0,0.001",
    "body_bar_young": "2e4",
    "body_bar_velocity": "0.2,0,-0.5",
    "effects": "gravity,floor",
    "effect_floor_type": "contact",
    "effect_floor_obstacle": "plane:0,0,1,0",
    "effect_floor_friction": "0.3",
    "ts_dt": "0.005",
}
del CUBE["effect_hold_type"], CUBE["effect_hold_on"]

# A cube that falls on another one.
TWO = {
    "bodies": "low,high",
    "body_default_material": "corotated",
    "body_default_young": "2e4",
    "body_default_poisson": "0.3",
    "body_low_mesh": "box:0.1,0.1,0.1:1",
    "body_high_mesh": "box:0.1,0.1,0.1:1",
    "body_high_translate": "0.01,0,0.1002",
    "body_high_velocity": "0,0,-0.3",
    "effects": "gravity,bed,meet",
    "effect_bed_type": "fixed",
    "effect_bed_on": "low.zmin",
    "effect_meet_type": "contact",
    "effect_meet_friction": "0.2",
    "time": "euler_implicit",
    "ts_dt": "0.005",
    "ts_max_time": "0.02",
    "output_fields": "none",
}


class Failure(Exception):
    """What a row lacks."""


def check(good: object, text: str) -> None:
    if not good:
        raise Failure(text)


def call(command: list, fails: bool = False, **more: str) -> str:
    """Runs a command; returns what it printed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, cwd=TOP,
                          env=os.environ | more)
    text = done.stdout + done.stderr
    check((done.returncode != 0) == fails,
          f"exit code {done.returncode} of {shlex.join(map(str, command))}: {text[-500:]}")
    return text


def command(scene: dict, *more: object, ranks: int = 1, folder: str = "run") -> list:
    """The program with a scene; more: further words, a switch or an option and its value."""
    OUT.mkdir(parents=True, exist_ok=True)
    path = OUT / "scene.opts"
    path.write_text("".join(f"-{name} {value}\n" for name, value in scene.items()))
    start = [*MPI, str(ranks)] if ranks > 1 else []
    return [*start, SUPPLE, path, "-output_dir", OUT / folder, "-output_overwrite", *more]


def run(scene: dict, *more: object, **how: object) -> str:
    return call(command(scene, *more, **how))


def refused(scene: dict, *more: object) -> str:
    return call(command(scene, *more, folder="refused"), fails=True)


def last(folder: str = "run") -> dict[str, float]:
    """Last row of the history."""
    with open(OUT / folder / "history.csv") as file:
        return {name: float(value) for name, value in list(csv.DictReader(file))[-1].items()}


def events(text: str) -> set[str]:
    return set(re.findall(r"^(Sb\w+)", text, re.M))


def functions_called(words: list) -> set[str]:
    """Functions of shared libraries that a command called."""
    for old in OUT.glob("linker.*"):
        old.unlink()
    call(words, LD_DEBUG="bindings", LD_DEBUG_OUTPUT=str(OUT / "linker"))
    called = set()
    for path in OUT.glob("linker.*"):
        called |= set(re.findall(r"symbol `(\w+)'", path.read_text(errors="replace")))
        path.unlink()
    return called


def objects(text: str, kind: str) -> set[str]:
    """Types of the objects of a kind (KSP, PC, Mat, TS, DM) in PETSc's views."""
    return set(re.findall(rf"^ *{kind} Object:.*\n *type: (\w+)", text, re.M))


# -------------------------------------------------------------------------------------- the rows


def any_ranks() -> None:
    motion = []
    for ranks in (1, 2, 3):
        run(BAR, ranks=ranks)
        motion.append(last()["max_displacement"])
    check(motion[0] > 0 and numpy.allclose(motion, motion[0], rtol=1e-6), f"motions {motion}")
    text = run(BAR | {"body_bar_mesh": "box:0.1,0.1,0.1:1"}, ranks=8)
    tets = int(re.search(r"^bar +p1 +(\d+)", text, re.M)[1])
    check(tets < 8, f"{tets} tets are not fewer than ranks")
    check(re.search(r"(?:Petsc|PETSc) (?:Release|Development)", call([SUPPLE, "-version"])), "no PETSc")


def packages() -> None:
    called = functions_called(command(
        BAR, "-solver", "cholmod", "-output_fields", "position", ranks=2))
    for name, pattern in {"PETSc": "TSCreate", "METIS": "METIS_PartGraph", "HDF5": "H5Fcreate",
                          "MPI": "MPI_Init", "SuiteSparse": "cholmod_l?_?factorize"}.items():
        check(any(re.match(pattern, function) for function in called), f"{name} is not called")
    view = run(BAR, "-solver", "cholmod", "-ksp_view")
    check("package used to perform factorization: cholmod" in view, "CHOLMOD factors nothing")
    called = functions_called([SUPPLE_MESH, "tet", "tests/data/bead.obj", OUT / "bead.msh",
                               "-tetrahedralizer", "gmsh"])
    check(any("gmsh" in function for function in called), "the gmsh library is not loaded")


def top_level() -> None:
    for name in ("src", "include", "scenarios", "meshes", "tests", "scripts"):
        check((TOP / name).is_dir(), f"no folder {name}/")
    text = call(["make", "-s", "help"])
    for target in ("check", "lint"):
        check(re.search(rf"\b{target}\b", text), f"no target {target}")


def dmplex() -> None:
    ncell = 4 * 6
    text = run(BAR, "-dm_view", ranks=2)
    check("plex" in objects(text, "DM"), "-dm_view shows no DM Object of type plex")
    check(re.search(r"^ *Labels:\n", text, re.M), "-dm_view shows no labels")
    counts = re.search(r"Number of 3-cells per rank: ([\d ()]+)", text)
    counts = [int(word) for word in re.findall(r"(\d+)(?: \(\d+\))?", counts[1])] if counts else []
    check(len(counts) == 2 and sum(counts) > ncell, f"cells per rank {counts}: not distributed "
          f"with an overlap, of {ncell} in all")
    motion = []
    for partitioner in ("metis", "simple", "bisection"):
        text = run(BAR, "-petscpartitioner_type", partitioner, ranks=2)
        check("nobody read" not in text, f"-petscpartitioner_type {partitioner} is not read")
        motion.append(last()["max_displacement"])
    check(numpy.allclose(motion, motion[0], rtol=1e-6), f"partitioners give motions {motion}")


def stiffness() -> None:
    for element in ("p1", "p2", "cr", "dg"):
        text = run(BAR, "-body_bar_element", element, "-solver", "cg", "-ksp_view", "-log_view")
        rows = int(re.search(rf"^bar +{element} +\d+ +\d+ +(\d+)", text, re.M)[1])
        check(objects(text, "Mat") == {"seqbaij"} and f"rows={rows}, cols={rows}, bs=3" in text,
              f"{element}: no Mat of {rows} rows")
        check(f"SbElem_{element}" in events(text), f"no log event of {element}")
    for law in ("linear", "corotated", "stvk", "stable_neohookean"):
        text = run(BAR, "-body_bar_material", law, "-solver", "cg_icc", "-ksp_view", "-log_view",
                   folder=law)
        check("seqsbaij" in objects(text, "Mat"), f"{law}: no Mat of type seqsbaij")
        check(f"SbMat_{law}" in events(text), f"no log event of {law}")
    sag = {law: last(law)["max_displacement"] for law in ("linear", "corotated", "stvk",
                                                          "stable_neohookean")}
    check(len(set(sag.values())) == 4 and max(sag.values()) < 1.1 * min(sag.values()), f"{sag}")


def time_stepping() -> None:
    kinds = {}
    for preset in ("euler_implicit", "newmark", "genalpha", "alpha2", "euler_symplectic",
                   "euler_explicit"):
        text = run(BAR, "-time", preset, "-ts_dt", "1e-3", "-ts_max_time", "3e-3", "-ts_view")
        kinds[preset] = objects(text, "TS")
        check(len(kinds[preset]) == 1 and last()["step"] >= 3, f"{preset}: TS {kinds[preset]}")
    check(kinds["alpha2"] == {"alpha2"}, f"alpha2 runs {kinds['alpha2']}")
    check(not objects(run(BAR, "-time", "static", "-ts_view"), "TS"), "a static run has a TS")


def slide(response: str, *more: object) -> tuple[str, dict[str, float]]:
    """The cube on the floor; what was printed and the last row."""
    text = run(CUBE, "-effect_floor_response", response, *more)
    found = last()
    check(found["floor_contacts"] == 9 and found["floor_force_z"] > 20 and
          found["floor_force_x"] < -2, f"{response}: no contact with friction: {found}")
    return text, found


def projected() -> None:
    text, found = slide("projected", "-solver", "cg_jacobi", "-ksp_view", "-log_view")
    check("null space of constraints" in text and "SbProject" in events(text),
          "no KSP in the null space of the constraints")
    check(found["floor_penetration"] <= 1e-12, f"penetration {found['floor_penetration']} m")
    meet("projected")


def meet(response: str) -> None:
    """Bodies meet each other, without and with a search for contact with themselves."""
    for itself in ("no", "yes"):
        run(TWO, "-effect_meet_response", response, "-effect_meet_self", itself)
        found = last()
        check(found["meet_contacts"] > 0 and found["meet_gap"] > 0,
              f"{response}, self {itself}: bodies do not meet: {found}")


def penalty_and_multipliers() -> None:
    force = {}
    for response in ("projected", "multiplier", "augmented", "penalty", "barrier"):
        text, found = slide(response)
        force[response] = found["floor_force_z"]
        deep = found["floor_penetration"]
        check((deep > 1e-5) == (response == "penalty"), f"{response}: penetration {deep} m")
        check(("multipliers of contact" in text) == (response == "multiplier"),
              f"{response}: solved as {re.findall('multipliers.*', text)}")
    check(len(set(force.values())) == 5 and max(force.values()) < 1.05 * min(force.values()),
          f"responses give the forces {force}")
    for response in ("multiplier", "augmented", "penalty", "barrier"):
        meet(response)


def neighbour_search() -> None:
    """The hash searches between bodies, with and without self-contact; trees find the same."""
    overlap = {"body_high_translate": "0.01,0,0.0985", "body_high_velocity": "0,0,0"}
    for more in ({}, {"effect_meet_self": "yes"}, overlap):
        found = {}
        for search in ("hash", "tree"):
            text = run(TWO | more, "-effect_meet_search", search, "-log_view")
            searched = events(text) & {"SbSearchHash", "SbSearchTree"}
            check(searched == {"SbSearch" + search.title()}, f"-effect_meet_search {search}: "
                  f"events {searched}")
            found[search] = last()
            if more is overlap:
                check(re.search(r"points are up to [\d.e-]+ m deep", text),
                      "no penetration depth of bodies that overlap")
        check(found["hash"]["meet_contacts"] > 0, f"no contact: {found['hash']}")
        same = [name for name, value in found["hash"].items() if "wall" not in name and
                "seconds" not in name and not (value == found["tree"][name] or
                                               math.isnan(value))]
        check(not same, f"hash and tree differ in {same}")
    check("SbSearchHash" in events(run(TWO, "-log_view")), "the hash is not the search of contact")


def trees_and_distances() -> None:
    scene = CUBE | {"effect_floor_obstacle": "mesh:tests/data/bead.obj",
                    "effect_floor_obstacle_at": "0.05,0.05,-0.03", "effect_floor_friction": "0"}
    run(scene, "-effect_floor_response", "projected")
    found = last()
    check(found["floor_contacts"] > 0 and found["floor_penetration"] < 1e-3,
          f"signed distance of a mesh: {found}")
    text = run(scene, "-effect_floor_response", "barrier", "-effect_floor_obstacle_at",
               "0.05,0.05,-0.033", "-log_view")
    found = last()
    check("SbSearchTree" in events(text) and found["floor_contacts"] > 0 and
          found["floor_gap"] > 0,
          f"tree of boxes: {found}")


def solvers_by_name() -> None:
    seen = {}
    for name in ("cg", "cg_jacobi", "cg_icc", "gauss_seidel", "sor", "direct"):
        text = run(BAR, "-solver", name, "-ksp_view")
        seen[name] = (objects(text, "KSP"), objects(text, "PC"), last()["max_displacement"])
        relaxation = re.search(r"omega = ([\d.]+)", text)
        if name in ("gauss_seidel", "sor"):
            omega = float(relaxation[1])
            check((omega == 1) == (name == "gauss_seidel"), f"{name}: omega {omega}")
    for name, types in {"cg": ("cg", "none"), "cg_jacobi": ("cg", "jacobi"),
                        "cg_icc": ("cg", "icc"), "gauss_seidel": ("richardson", "sor"),
                        "sor": ("richardson", "sor")}.items():
        kinds = seen[name]
        within = re.findall(r"type: (\w+)", run(BAR, "-solver", name, "-ksp_view"))
        check(types[0] in kinds[0] and (types[1] in kinds[1] or types[1] in within),
              f"{name}: {kinds}")
        check(math.isclose(kinds[2], seen["direct"][2], rel_tol=1e-3), f"{name}: {seen}")
    text, _ = slide("projected", "-solver", "cg_jacobi", "-ksp_view")
    check("between projections into the null space" in text, "no filtered PCG")


def elasticity() -> None:
    for options in (("material", "linear"), ("material", "corotated"), ("element", "dg")):
        text = run(BAR, f"-body_bar_{options[0]}", options[1], "-log_view")
        name = ("SbMat_" if options[0] == "material" else "SbElem_") + options[1]
        check(name in events(text) and last()["max_displacement"] > 0, f"{options}")


def meshes() -> None:
    for file, ntet in (("tetgen.ele", 36), ("netgen.vol", 12), ("netgen.neu", 12)):
        text = call([SUPPLE_MESH, "info", f"tests/data/{file}"])
        check(re.search(rf"^ *tets +{ntet}$", text, re.M), f"{file}: {text[:300]}")
    for program in ("gmsh", "tetgen"):
        text = call([SUPPLE_MESH, "tet", "tests/data/bead.obj", OUT / f"{program}.msh",
                     "-tetrahedralizer", program])
        check(f"by {program}" in text, f"{program}: {text[:300]}")
        text = call([SUPPLE_MESH, "info", OUT / f"{program}.msh"])
        check(int(re.search(r"^ *tets +([\d,]+)$", text, re.M)[1].replace(",", "")) > 1000, text)
    text = run(BAR | {"body_bar_mesh": "box:0.2,0.2,0.2:4"}, "-remesh_times", "0.01",
               "-remesh_size", "0.5")
    found = re.search(r"re-meshed after step 1, .* (\d+) -> (\d+) tets", text)
    check(found and int(found[2]) > int(found[1]) and last()["step"] == 2, "no re-meshing")


def live() -> None:
    scene = BAR | {"output_fields": "position,von_mises"}
    words = command(scene)
    picture = OUT / "live.png"
    text = call([sys.executable, "scripts/live", "--picture", picture, words[1], *words[2:]])
    check("frames" in text and picture.stat().st_size > 5000, f"no picture: {text}")

    # the axes of space, red, green and blue, left below
    corner = numpy.asarray(PIL.Image.open(picture).convert("RGB")).astype(int)[580:, 330:450]
    for i in range(3):
        others = numpy.delete(corner, i, axis=2).max(axis=2)
        check(((corner[..., i] > 120) & (others < 60)).sum() > 10, f"no axis {'xyz'[i]} in the picture")


def rigid() -> None:
    scene = TWO | {"body_high_rigid": "yes", "body_high_density": "500", "ts_max_time": "0.3",
                   "ts_dt": "0.01", "effects": "gravity,bed,meet", "effect_meet_pairs": "yes"}
    run(scene, ranks=2)
    end = last()
    weight = 500 * 0.1**3 * 9.81
    check(abs(end["meet_low_high_force_z"] - weight) < 0.05 * weight,
          f"a rigid cube of {weight} N lies on a soft one with {end['meet_low_high_force_z']} N")
    check(end["kinetic"] < 1e-3, f"it does not come to rest: {end['kinetic']} J")
    text = run(scene, "-ts_max_time", "0.01", "-effect_meet_friction", "0")
    check(re.search(r"high +rigid +\d+ +4 +12 ", text), f"a rigid body has no 12 unknowns: {text}")
    text = refused(scene, "-effect_meet_response", "penalty")
    check("rigid" in text, text)


def files() -> None:
    run(BAR, "-output_fields", "position,stress", ranks=2)
    root = ElementTree.parse(OUT / "run" / "fields.xmf").getroot()
    grids = [grid for grid in root.iter("Grid") if grid.get("GridType") == "Uniform"]
    items = {item.text.strip() for grid in grids for item in grid.iter("DataItem")}
    names = {item.split(":", 1)[1] for item in items if ":/" in item}
    check(len(grids) == 3 and names, f"{len(grids)} frames in fields.xmf")
    with h5py.File(OUT / "run" / "fields.h5") as file:
        check(all(name in file for name in names), f"an array of {names} is missing")
        check(any(numpy.any(file[name][()]) for name in names if "stress" in name), "no stresses")
    with h5py.File(OUT / "run" / "fields.vtkhdf") as file:
        check("VTKHDF" in file, "fields.vtkhdf is not VTK's")


def make_check() -> None:
    text = call([sys.executable, "tests/run", "--build", BUILD, "--supple", SUPPLE, "--group",
                 "verify", "--match", "verify_nothing", "--jobs", "2", "--verbose"])
    check("(2 ranks)" in text and "2 passed, 0 failed" in text, text[-300:])


def accuracy() -> None:
    text = run(BAR, "-ledger")
    for source in ("space", "time", "nonlinear", "linear", "contact", "rounding"):
        check(re.search(rf"^{source} .*\d\.\d+e", text, re.M), f"no row {source} in the ledger")
    with open(OUT / "run" / "ledger.csv") as file:
        check(len(list(csv.reader(file))) > 6, "ledger.csv is empty")
    steps = []
    for target in ("0.3", "0.05"):
        text = run(BAR, "-accuracy", target)
        check(f"-accuracy {target} was" in text, f"nothing is said of -accuracy {target}")
        steps.append(last()["step"])
    check(steps[1] > steps[0], f"steps {steps}")
    check("usage" in call([sys.executable, "scripts/accuracy", "--help"]), "scripts/accuracy")


def hard_cases() -> None:
    program = BUILD / "tests" / "hard" / "hard"
    cases = call([program, "-list"]).splitlines()
    check(len(cases) > 20, f"{len(cases)} hard cases")
    text = call([program, "-case", "impact.corner.p1", "-runs", "1"])
    check(re.search(r"^[1-9]\d* passed, 0 failed$", text, re.M), text[-300:])


def effects_named() -> None:
    text = call([*MPI, "1", BUILD / "tests" / "verify" / "verify_nothing"])
    check(re.search(r"^[1-9]\d* passed, 0 failed$", text, re.M), text[-300:])
    bare = events(run(BAR, "-log_view"))
    strange = {"SbContact", "SbSearch", "SbEff_contact", "SbEff_damping", "SbElem_dg"} & bare
    check(not strange and "SbEff_gravity" in bare, f"events {strange} of effects without a name")


ROWS: dict[str, Callable[[], None]] = {
    "C program on PETSc, `mpirun` on scenario option files": any_ranks,
    "packages: PETSc, METIS, HDF5, Open MPI, SuiteSparse, gmsh": packages,
    "top level: Makefile, src/, include/, scenarios/, meshes/, tests/, scripts/": top_level,
    "DMPlex for tet meshes": dmplex,
    "co-rotated and DG stiffness in Mat objects": stiffness,
    "time stepping by TS: implicit Euler, Newmark (through generalized-alpha)": time_stepping,
    "contact by KSP with projected constraints": projected,
    "penalty and Lagrange multipliers": penalty_and_multipliers,
    "hashed neighbour search, consistent penetration depth and normal": neighbour_search,
    "bounding volume hierarchies, distance fields": trees_and_distances,
    "CG, PCG, filtered (projected) PCG, Gauss-Seidel, SOR": solvers_by_name,
    "linear, co-rotated, discontinuous Galerkin elasticity": elasticity,
    "tetrahedralisation and re-meshing, TetGen and Netgen files": meshes,
    "something to look at while it runs, and a GUI": live,
    "rigid bodies in the same scene": rigid,
    "XDMF/HDF5 output, read by ParaView": files,
    "`make check` on 2 ranks": make_check,
    "shows what accuracy costs in time": accuracy,
    "hard cases stay numerically stable, proved by tests": hard_cases,
    "simulates only the effects that a scene calls for": effects_named,
}

# What the program does not do yet, as the table says it; no other row may say "not there yet".
NOT_YET: dict[str, str] = {}


def table() -> dict[str, str]:
    """Where each row of the document is held, by its name."""
    text = (TOP / "docs" / "architecture.md").read_text()
    part = text.split("## What the program was asked to be\n", 1)[-1].split("\n## ", 1)[0]
    rows = [line.strip("| ").split(" | ") for line in part.splitlines() if line.startswith("| ")]
    return {row[0]: row[-1] for row in rows[1:]}


def document(row: str, where: str) -> None:
    """Whether the table names places that are there, and says what is not there yet."""
    for place in re.findall(r"`([\w./]+)`", where):
        check((TOP / place).exists(), f"docs/architecture.md names {place}, which is not there")
    if row in NOT_YET:
        check(NOT_YET[row] in where, f"docs/architecture.md does not say '{NOT_YET[row]}'")
    else:
        check("not there yet" not in where.lower(), "docs/architecture.md says 'not there yet'")


def main() -> None:
    rows = table()
    failed = [f"no row '{row}' in docs/architecture.md" for row in ROWS if row not in rows]
    failed += [f"no check of the row '{row}'" for row in rows if row not in ROWS]
    only = sys.argv[1:]
    for row, look in ROWS.items():
        if only and look.__name__ not in only:
            continue
        try:
            document(row, rows.get(row, ""))
            look()
        except (Failure, OSError, KeyError, TypeError, ValueError, subprocess.SubprocessError) as e:
            failed.append(f"{row}: {type(e).__name__ * (not isinstance(e, Failure))} {e}")
            print("failed:", failed[-1], flush=True)
    shutil.rmtree(OUT / "run", ignore_errors=True)
    if failed:
        text = "; ".join(failed).replace("\n", " ")
        sys.exit(f"{len(failed)} of {len(ROWS)} rows: {text[:1500]}")


if __name__ == "__main__":
    main()
