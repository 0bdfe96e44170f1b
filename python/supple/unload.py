"""The shape without loads of bodies whose meshes are their loaded shapes: a breast as it was
scanned, an artery under its pressure.

Wanted is the rest shape X with which the static run of a scenario ends at the given shape x_g, in
the vertices of the meshes. A fixed point (Sellier 2011) with Aitken's relaxation (Irons and Tuck
1969):

    r_k = x_g - x(X_k),   X_(k+1) = X_k + w_k r_k,
    w_(k+1) = -w_k r_k.(r_(k+1) - r_k)/|r_(k+1) - r_k|^2

Not handled: curved tets of the given mesh, copies of a body, paths of loading that matter
(friction, histories: the run begins without any), shapes of which a body has no rest shape, or
several.
"""

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy

from .run import Run, RunError
from .study import Table, program, scenario_view, start

# Aitken's number beyond these says that a step was not of one mode: it is kept within
RELAXATIONS = (0.1, 2.0)
# times the distance of the first round at which it ends: cantilevers and spheres that came near
# never had more than in the first
APART = 2.0
HALVINGS = 5  # of a relaxation after which a tet still turns over, or the run fails


class Unloaded:
    """What was found.

    meshes     - {body: path of its mesh at rest}, supple's .h5 with the groups of the given one
    options    - lines of a scenario that take them
    distances  - of each round, the largest distance of a vertex from the given shape, over the size
    size       - diagonal of the box around the given shape, m
    volumes    - {body: (at rest, as given)}, m^3
    run        - Run of the rest shape
    """

    def __init__(
        self,
        meshes: dict[str, str],
        options: list[str],
        rounds: Table,
        size: float,
        volumes: dict[str, tuple[float, float]],
        run: Run,
    ) -> None:
        self.meshes, self.options, self.rounds, self.size, self.volumes, self.run = (
            meshes,
            options,
            rounds,
            size,
            volumes,
            run,
        )

    @property
    def distances(self) -> numpy.ndarray:
        return self.rounds["distance"]

    def __str__(self) -> str:
        volumes = [
            f"{body}: {rest:.6g} m^3 at rest, {given:.6g} m^3 as given"
            for body, (rest, given) in self.volumes.items()
        ]
        return "\n".join([*volumes, "", *self.options])

    __repr__ = __str__


def volumes_of(x: numpy.ndarray, cells: numpy.ndarray) -> numpy.ndarray:
    """Of tets [n], m^3, negative where one is turned over."""
    a, b, c, d = (x[cells[:, k]] for k in range(4))
    return numpy.einsum("ij,ij->i", numpy.cross(b - a, c - a), d - a) / 6


class Body:
    """A mesh in the folder, its given vertices and tets, and which points of a run they are."""

    def __init__(self, name: str, view: dict[str, str], folder: str | Path) -> None:

        def of(key: str) -> str:
            return view.get(f"body_{name}_{key}", "")

        self.name, self.path = name, Path(folder) / f"{name}.h5"
        if of("copies"):
            raise RunError(
                f"body {name} has copies, which have one mesh: give each a body of its own"
            )
        words = [
            program() + "-mesh",
            "convert",
            of("mesh"),
            str(self.path),
            "-quiet",
            "-scale",
            of("scale"),
            "-rotate",
            of("rotate"),
            "-translate",
            of("translate"),
        ]
        words += ["-step", of("mesh_step")] if of("mesh_step") not in ("", "0") else []
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode:
            lines = done.stderr.strip().splitlines() or ["its mesh cannot be converted"]
            raise RunError(
                f"body {name}: {lines[-1]}. A surface is filled once, by supple-mesh tet, "
                "so that all rounds have the same tets"
            )
        with h5py.File(self.path, "r") as file:
            if "mesh/curved_edges" in file:
                raise RunError(
                    f"body {name}: {of('mesh')} has curved tets, which are not unloaded: save it "
                    "with first order"
                )
            self.given, self.cells = file["mesh/x"][()], file["mesh/cells"][()]
        self.sign = numpy.sign(volumes_of(self.given, self.cells))
        self.used = numpy.unique(self.cells)

    @property
    def options(self) -> dict[str, Any]:
        """That take its mesh as it is in the file, by name."""
        found = {
            "mesh": str(self.path),
            "scale": 1,
            "rotate": (0, 0, 1, 0),
            "translate": (0, 0, 0),
            "mesh_step": 0,
        }
        return {f"body_{self.name}_{key}": value for key, value in found.items()}

    def write(self, x: numpy.ndarray) -> None:
        with h5py.File(self.path, "r+") as file:
            file["mesh/x"][...] = x

    def turned(self, x: numpy.ndarray) -> str | None:
        """A message about the tets that are turned over, or None."""
        volume = volumes_of(x, self.cells) * self.sign
        bad = numpy.nonzero(volume <= 0)[0]
        if not len(bad):
            return None
        place = x[self.cells[bad[0]]].mean(axis=0)
        return (
            f"{len(bad)} of {len(self.cells)} tets of body {self.name} turn over, the first one is "
            f"tet {bad[0]} at {', '.join(f'{v:.4g}' for v in place)} m"
        )

    def find(self, run: Run, x: numpy.ndarray) -> None:
        """Which points of the run the vertices x in use are: they lie there at rest."""
        from scipy.spatial import cKDTree

        mesh = run.mesh(0)
        points = numpy.unique(mesh.cells[mesh.body == run.bodies.index(self.name)])
        off, nearest = cKDTree(mesh.x[points]).query(x[self.used])
        if off.max() > 1e-9 * numpy.ptp(x[self.used], axis=0).max():
            raise RunError(
                f"body {self.name}: {(off > 0).sum()} of {len(off)} vertices of its mesh are "
                "not where the run has points; the mesh was changed as it was read: repair "
                "it by supple-mesh repair before"
            )
        self.points = points[nearest]


def picked_by_place(run: Run) -> dict[str, numpy.ndarray]:
    """{set: points} that the run has."""
    return {name: run.field(name) for name in run.fields() if name.startswith("set_")}


def unload(
    scenario: str | Path,
    folder: str | Path = "out/unload",
    bodies: list[str] | None = None,
    tolerance: float = 1e-6,
    rounds: int = 50,
    relaxation: float = 1.0,
    ranks: int = 1,
    told: Callable[[dict[str, Any]], None] | None = None,
    **options: Any,
) -> Unloaded:
    """Finds the rest shape of the bodies of a static scenario, whose meshes are their shapes under
    the loads. Needs scipy.

    folder      - of the meshes at rest, NAME.h5, and of the run, in its subfolder run
    bodies      - names of those to unload; default: all that are not rigid
    tolerance   - largest distance of a vertex from the given shape, over the diagonal of the box
                  around all of them
    rounds      - runs at most
    relaxation  - of the first round
    told        - called with {round, distance, relaxation} after each
    options     - of all runs, as those of start()

    Returns an Unloaded; RunError where the scenario is not static, a tet turns over whatever the
    relaxation, the first run fails, or the rounds do not suffice.
    """
    view = scenario_view(scenario, folder)
    view |= {name: str(value) for name, value in options.items()}
    if view.get("time") != "static":
        raise RunError(
            f"{scenario} has -time {view.get('time')}: a shape under loads is that of -time static"
        )
    if not 0 < relaxation <= 2 or not tolerance > 0 or rounds < 1:
        raise RunError(
            f"relaxation {relaxation:g} is in (0, 2], tolerance {tolerance:g} above 0, rounds "
            f"{rounds} at least 1"
        )
    names = [name.strip() for name in view["bodies"].split(",")]
    wanted = bodies or [name for name in names if view.get(f"body_{name}_rigid") != "true"]
    unknown = [name for name in wanted if name not in names]
    if unknown or not wanted:
        raise RunError(
            f"{scenario} has no body {', '.join(unknown)}; it has {', '.join(names)}"
            if unknown
            else f"{scenario} has rigid bodies only"
        )
    Path(folder).mkdir(parents=True, exist_ok=True)
    parts = [Body(name, view, folder) for name in wanted]
    size = float(
        numpy.linalg.norm(
            numpy.ptp(numpy.concatenate([part.given[part.used] for part in parts]), axis=0)
        )
    )
    # digits that the distances need, unless the caller says otherwise
    settings = {
        "output_precision": "double",
        "output_fields": "displacement,sets",
        "output_discontinuous": False,
        "output_every_steps": 1000000,
        "snes_rtol": 1e-9,
    } | options
    for part in parts:
        settings |= part.options

    def ended(x: list[numpy.ndarray]) -> tuple[Run, list[numpy.ndarray]]:
        """(Run, residuals) of the rest shape x, a list; residuals [n][3] of the vertices in use."""
        for part, own in zip(parts, x):
            part.write(own)
        run = start(scenario, Path(folder) / "run", ranks, **settings)
        for part, own in zip(parts, x):
            part.find(run, own)
        now = run.positions(-1)
        return run, [part.given[part.used] - now[part.points] for part in parts]

    def moved(x: list[numpy.ndarray], r: list[numpy.ndarray], w: float) -> list[numpy.ndarray]:
        new = [own.copy() for own in x]
        for part, own, off in zip(parts, new, r):
            own[part.used] += w * off
        return new

    x, w = [part.given for part in parts], relaxation
    rows: list[dict[str, Any]] = []
    try:
        run, r = ended(x)
    except RunError as e:
        raise RunError(
            f"the first run, which loads the given shape once more, fails: {e}"
        ) from None
    sets = picked_by_place(run)
    while True:
        distance = max(float(numpy.linalg.norm(off, axis=1).max()) for off in r) / size
        rows.append({"round": len(rows) + 1, "distance": distance, "relaxation": w})
        if told:
            told(rows[-1])
        if distance <= tolerance:
            break
        if distance > APART * rows[0]["distance"]:
            raise RunError(
                f"round {len(rows)} ends {distance:.2g} of the size from the given shape, "
                f"{APART:g} times as far as the first one: these loads move the body too far for "
                "this method; try smaller ones, or a smaller first relaxation"
            )
        if len(rows) == rounds:
            raise RunError(
                f"after {rounds} rounds the run ends {distance:.2g} of the size from the given "
                f"shape, more than the tolerance {tolerance:g}: more rounds, a smaller first "
                "relaxation, or loads that move it less"
            )
        run.close()
        # a shape with a tet that is turned over, or that the loads crush, is nearer to the last one
        for halving in range(HALVINGS + 1):
            new = moved(x, r, w)
            why = next(filter(None, (part.turned(own) for part, own in zip(parts, new))), None)
            if why is None:
                try:
                    run, after = ended(new)
                    break
                except RunError as e:
                    why = str(e)
            if halving == HALVINGS:
                raise RunError(
                    f"round {len(rows) + 1}: {why}, also with a relaxation of {w:.2g}. Does the "
                    "given shape belong to these loads? A finer mesh or smaller loads may do"
                ) from None
            w /= 2
        now = picked_by_place(run)
        changed = [
            name
            for name, values in sets.items()
            if name not in now or not numpy.array_equal(values, now[name])
        ]
        if changed:
            raise RunError(
                f"{changed[0].removeprefix('set_')} has other points or tets at rest than in the "
                "given shape: it is found by its place; make it a group of the mesh file"
            )
        flat, flat_after = (
            numpy.concatenate(list(map(numpy.ravel, values))) for values in (r, after)
        )
        change = flat_after - flat
        w = (
            float(numpy.clip(-w * (flat @ change) / (change @ change), *RELAXATIONS))
            if change.any()
            else w
        )
        x, r = new, after

    total = lambda part, shape: float(abs(volumes_of(shape, part.cells)).sum())
    volumes = {
        part.name: (total(part, own), total(part, part.given)) for part, own in zip(parts, x)
    }
    lines = []
    for part in parts:
        lines.append(f"-body_{part.name}_mesh {part.path}")
        for key, rest in (
            ("scale", "1"),
            ("rotate", "0,0,1,0"),
            ("translate", "0,0,0"),
            ("mesh_step", "0"),
        ):
            if view.get(f"body_{part.name}_{key}", rest) != rest:
                lines.append(f"-body_{part.name}_{key} {rest}")
    return Unloaded(
        {part.name: str(part.path) for part in parts}, lines, Table(rows), size, volumes, run
    )
