"""The folder of a run, read: meshes, frames, fields, history, settings."""

import importlib
import json
import os
import stat
import time
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy

TEXT_BYTES = 1 << 28  # largest size of a text file, as SB_TEXT_BYTES
TENSOR = ("xx", "xy", "xz", "yy", "yz", "zz")  # order of six components in fields.h5
# of a tet, counter-clockwise seen from outside
FACES = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))


class RunError(Exception):
    """A folder or file is not what it should be, a name is unknown, or a run failed; the message
    says which."""


def read_text(path: str | Path, most: int = TEXT_BYTES) -> str:
    """A text file of a limited size; OSError where it is another kind of file (a pipe, a device) or
    larger."""
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(handle, encoding="utf-8", errors="replace") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(f"{path} is not a regular file")
        text = file.read(most + 1)
    if len(text) > most:
        raise OSError(f"{path} is larger than {most} bytes")
    return text


def needed(module: str, what: str) -> Any:
    """A package that only this needs. RunError without it."""
    try:
        return importlib.import_module(module)
    except ImportError as e:
        raise RunError(
            f"{what}() needs the package {module}, which is not installed ({e}): "
            f"pip install {'meshio pyvista' if what == 'to_pyvista' else module}"
        ) from None


def own(group: Any, name: str) -> Any:
    """The object at a path in an HDF5 group. RunError where it is not in the file itself: a link to
    another name or file, a dataset whose numbers are in other files."""
    for part in name.strip("/").split("/"):
        link = group.get(part, getlink=True)
        if link is not None and not isinstance(link, h5py.HardLink):
            raise RunError(
                f"{group.file.filename}: {group.name.rstrip('/')}/{part} is a link to another "
                "place; a results file of supple has none, so this one is not read"
            )
        group = group[part]
    if isinstance(group, h5py.Dataset) and (group.external or group.is_virtual):
        raise RunError(
            f"{group.file.filename}: the numbers of {group.name} are in other files; "
            "a results file of supple holds all of its own, so this one is not read"
        )
    return group


class Surface:
    """The boundary of tets: the faces, by their vertices, that belong to one tet only.

    points     [n], numbers of the mesh's points that are on it
    triangles  [m][3], into `points`, counter-clockwise seen from outside
    owner      [m], the tet behind each triangle
    """

    def __init__(self, cells: numpy.ndarray, vertices: numpy.ndarray) -> None:
        faces = numpy.concatenate([cells[:, c] for c in FACES]).astype(numpy.int64)
        owner = numpy.tile(numpy.arange(len(cells)), 4)
        nvert = vertices.max() + 1
        low, middle, high = numpy.sort(
            numpy.concatenate([vertices[:, c] for c in FACES]).astype(numpy.int64), axis=1
        ).T
        _, first, count = numpy.unique(
            (low * nvert + middle) * nvert + high, return_index=True, return_counts=True
        )
        once = first[count == 1]
        self.owner = owner[once]
        self.points, triangles = numpy.unique(faces[once], return_inverse=True)
        self.triangles = triangles.reshape(-1, 3)
        self.cells, self.vertices, self.nvert = cells, vertices, nvert
        self.vertex = numpy.zeros(cells.max() + 1, dtype=numpy.int64)  # of each point
        self.vertex[cells.ravel()] = vertices.ravel()
        self.share = numpy.bincount(vertices.ravel(), minlength=nvert)

    def is_per_cell(self, values: numpy.ndarray) -> bool:
        return len(values) == len(self.cells)

    def at_points(self, values: numpy.ndarray) -> numpy.ndarray:
        """Values [n] at the surface's points of scalars per point or per cell; those of cells are
        averaged around each vertex."""
        if self.is_per_cell(values):
            sums = numpy.zeros(self.nvert)
            for a in range(4):
                sums += numpy.bincount(self.vertices[:, a], weights=values, minlength=self.nvert)
            values = (sums / numpy.maximum(self.share, 1))[self.vertex]
        return values[self.points]


class Mesh:
    """The bodies' mesh at rest: x [npoint][3] m, cells [ncell][4] points, vertices [ncell][4]
    (which tell what points coincide where each cell has its own), body [ncell] number of the
    body, `arrays` the names of what else there is (sets, ranks). Where a body is of p2, cells10
    [n][10] are the points of the scene's tets, -1 in those of other elements (else None);
    without -output_quadratic `cells` are what these are cut into, and parent [ncell] says of
    which each is part (else None)."""

    def __init__(self, group: Any) -> None:
        self.path = group.name
        self.x, self.cells, self.body = (own(group, name)[()] for name in ("x", "cells", "body"))
        self.vertices = own(group, "vertices")[()] if "vertices" in group else self.cells
        self.cells10 = own(group, "cells10")[()] if "cells10" in group else None
        self.parent = own(group, "parent")[()] if "parent" in group else None
        self.arrays = [
            name for name in group if name not in ("x", "cells", "cells10", "vertices", "bodies")
        ]

    @cached_property
    def surface(self) -> Surface:
        return Surface(self.cells, self.vertices)

    def surface_of(self, body: int) -> Surface:
        """The surface of one body, by its number."""
        own = self.body == body
        return Surface(self.cells[own], self.vertices[own])


class Run:
    """What a run wrote into its folder; one that is going on may be read, and again with refresh().

    Frames are numbered from 0, negative ones from the end. A frame's arrays have the lengths of
    mesh(k), which changes where bodies were re-meshed."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.file: Any = None
        self.inode: int | None = None
        self.paths: list[str] = []
        self.about: dict[str, tuple[float, int]] = {}
        self.meshes: dict[int, Mesh] = {}
        self.rows: Any = None
        self.refresh()

    def __repr__(self) -> str:
        return f"<Run {self.folder}: {len(self)} frames, {self.info.get('status', 'no run.json')}>"

    def __len__(self) -> int:
        return len(self.paths)

    def refresh(self) -> None:
        """Reads again what there is; of a run that goes on only what is new."""
        for name in ("history", "info", "scenario"):
            self.__dict__.pop(name, None)
        self.close()
        path = self.folder / "fields.h5"
        if not path.is_file():
            if not (self.folder / "run.json").exists():
                raise RunError(
                    f"{path} does not exist; "
                    f"is {self.folder} the folder of a run with -output_fields?"
                )
            return  # a run without fields
        for attempts in range(5, 0, -1):
            try:
                self.read_index(path)
                return
            except (OSError, KeyError, RuntimeError, RunError) as e:
                self.close()  # HDF5 would go on reading what it had
                if attempts == 1:
                    raise RunError(
                        str(e)
                        if isinstance(e, RunError)
                        else f"{path} is not a results file of supple: {e}"
                    ) from None
                # a frame may have come while this was read, behind the end that the file had when
                # it was opened
                time.sleep(0.02)

    def read_index(self, path: Path) -> None:
        """Frames of fields.h5, and that the newest of them is whole."""
        self.file = h5py.File(path, "r", locking=False)
        # not by items(), where a group that has not come to the disk yet is None
        hundreds = own(self.file, "step")
        self.paths = sorted(
            (f"/step/{hundred}/{step}" for hundred in hundreds for step in own(hundreds, hundred)),
            key=lambda one: int(one.rpartition("/")[2]),
        )
        self.first_mesh = own(self.file, "mesh")
        for one in self.paths[-1:]:
            frame = own(self.file, one)
            _ = [own(frame, name) for name in frame]
        # another run in the same folder, or one that went on from a checkpoint: nothing of before
        # counts
        inode, known = path.stat().st_ino, [one for one in self.paths if one in self.about]
        if (
            inode != self.inode
            or len(known) < len(self.about)
            or known
            and self.about[known[-1]] != self.read_about(known[-1])
        ):
            self.about, self.meshes, self.inode = {}, {}, inode
        self.about |= {one: self.read_about(one) for one in self.paths if one not in self.about}

    def close(self) -> None:
        if self.file:
            self.file.close()
        self.file, self.paths = None, []

    def read_about(self, path: str) -> tuple[float, int]:
        """(time, number of the mesh) of a frame."""
        group = own(self.file, path)
        return float(group.attrs["time"]), int(group.attrs.get("mesh", 0))

    # ---------------------------------------------------------------- frames

    @property
    def times(self) -> numpy.ndarray:
        """[nframe] s; the load factor of a static run."""
        return numpy.array([self.about[path][0] for path in self.paths])

    @property
    def steps(self) -> numpy.ndarray:
        return numpy.array([int(path.rpartition("/")[2]) for path in self.paths])

    def frame(self, k: int) -> Any:
        if not -len(self) <= k < len(self):
            raise RunError(f"there is no frame {k}; the run has {len(self)}")
        return own(self.file, self.paths[k])

    def mesh(self, k: int = 0) -> Mesh:
        """The Mesh of a frame."""
        number = self.about[self.frame(k).name][1] if self.paths else 0
        if number not in self.meshes:
            self.meshes[number] = Mesh(own(self.file, f"mesh_{number:06d}" if number else "mesh"))
        return self.meshes[number]

    @property
    def bodies(self) -> list[str]:
        """Names, in the order of their numbers."""
        names = self.first_mesh.attrs.get("bodies", b"body")
        if "bodies" in self.first_mesh:  # too long for an attribute
            names = own(self.first_mesh, "bodies")[()]
        return (names.decode() if isinstance(names, bytes) else str(names)).split(",")

    def positions(self, k: int) -> numpy.ndarray:
        """Of the points [npoint][3] m in a frame; at rest where it has neither displacement nor
        position."""
        group, mesh = self.frame(k), self.mesh(k)
        if "displacement" in group:
            return mesh.x + own(group, "displacement")[()]
        return own(group, "position")[()].astype(float) if "position" in group else mesh.x

    def fields(self, k: int = -1) -> list[str]:
        """Names of a frame's fields, and of what belongs to its mesh."""
        frame = self.frame(k)
        return [name for name in frame if isinstance(own(frame, name), h5py.Dataset)] + self.mesh(
            k
        ).arrays

    def data(self, name: str, k: int = -1) -> Any:
        """The dataset of a field, with its attribute `unit`."""
        if name not in self.fields(k):
            raise RunError(f"the run has no field '{name}'; it has {', '.join(self.fields(k))}")
        return own(
            self.frame(k) if name in self.frame(k) else own(self.file, self.mesh(k).path), name
        )

    def field(self, name: str, k: int = -1) -> numpy.ndarray:
        """A field as it is stored: [n] or [n][3] or [n][6] (xx xy xz yy yz zz), per point or per
        cell."""
        return self.data(name, k)[()]

    def values(self, name: str, k: int = -1) -> tuple[numpy.ndarray, str]:
        """One number per point or cell, and the unit: a scalar, the length of a vector, or a
        component: velocity_x, stress_xy."""
        stem, _, letters = name.rpartition("_")
        component = None
        if name not in self.fields(k) and stem in self.fields(k) and self.data(stem, k).ndim == 2:
            letters_of = TENSOR if self.data(stem, k).shape[1] == 6 else ("x", "y", "z")
            if letters in letters_of:
                name, component = stem, letters_of.index(letters)
        data = self.data(name, k)
        values = numpy.asarray(data[()], dtype=float)
        unit = data.attrs.get("unit", b"")
        unit = unit.decode() if isinstance(unit, bytes) else str(unit)
        if component is not None:
            values = values[:, component]
        elif values.ndim == 2 and values.shape[1] == 3:
            values = numpy.linalg.norm(values, axis=1)
        elif values.ndim == 2:
            raise RunError(f"{name} is a tensor; name a component, {name}_xx, or von_mises")
        return values, unit

    # ---------------------------------------------------------------- tables and settings

    def read_history(self) -> tuple[numpy.ndarray, dict[str, str]]:
        path = self.folder / "history.csv"
        if not path.is_file():
            raise RunError(
                f"{path} does not exist: the run was made with -output_history no, or has not begun"
            )
        with open(path, "rb") as f:
            head = f.readline() + f.readline()
            names, units = (line.lstrip("#").split(",") for line in head.decode().splitlines())
            # (head, last line that was read, where it ends, table): of the same file that has grown
            # the lines behind are new
            if (
                self.rows
                and self.rows[0] == head
                and f.seek(self.rows[2] - len(self.rows[1])) >= 0
                and f.read(len(self.rows[1])) == self.rows[1]
            ):
                _, last, end, table = self.rows
            else:
                last, end, table = (
                    head,
                    len(head),
                    numpy.empty(0, dtype=[(name, float) for name in names]),
                )
            f.seek(end)
            lines = f.read().splitlines(keepends=True)
        lines = [
            line for line in lines if line.endswith(b"\n") and line.count(b",") == len(names) - 1
        ]
        table = numpy.concatenate(
            [
                table,
                numpy.array(
                    [tuple(map(float, line.split(b","))) for line in lines], dtype=table.dtype
                ),
            ]
        )
        self.rows = head, lines[-1] if lines else last, end + sum(map(len, lines)), table
        return table, dict(zip(names, units))

    @cached_property
    def history(self) -> numpy.ndarray:
        """history.csv as a structured array: history["strain"] is a column, history[-1] the last
        row; pandas.DataFrame() takes it."""
        return self.read_history()[0]

    @cached_property
    def units(self) -> dict[str, str]:
        """Unit of each column of the history."""
        return self.read_history()[1]

    @cached_property
    def info(self) -> dict[str, Any]:
        """run.json."""
        path = self.folder / "run.json"
        return json.loads(read_text(path)) if path.is_file() else {}

    @cached_property
    def scenario(self) -> dict[str, str]:
        """Options of scenario.opts, name without dash -> text."""
        path = self.folder / "scenario.opts"
        found: dict[str, str] = {}
        for line in read_text(path).splitlines() if path.is_file() else []:
            words = line.split("#")[0].split(None, 1)
            if words and words[0].startswith("-"):
                found[words[0][1:]] = words[1].strip().strip('"') if len(words) > 1 else ""
        return found

    @property
    def is_static(self) -> bool:
        return self.scenario.get("time") == "static"

    def up(self) -> numpy.ndarray | None:
        """Unit vector [3] against gravity; None where the scenario has none."""
        for name in self.scenario.get("effects", "").split(","):
            if self.scenario.get(f"effect_{name}_type") or name != "gravity":
                if self.scenario.get(f"effect_{name}_type") != "gravity":
                    continue
            try:
                g = numpy.array(
                    [float(x) for x in self.scenario[f"effect_{name}_vector"].split(",")]
                )
            except (KeyError, ValueError):
                continue
            if g.shape == (3,) and numpy.linalg.norm(g) > 0:
                return -g / numpy.linalg.norm(g)
        return None

    # ---------------------------------------------------------------- other libraries

    def to_meshio(self, k: int = -1) -> Any:
        """A meshio.Mesh of a frame: points where they are, fields per point and per cell."""
        meshio = needed("meshio", "to_meshio")
        mesh, names = self.mesh(k), self.fields(k)
        fields = {name: self.field(name, k) for name in names}
        on_cells = {
            name: [values] for name, values in fields.items() if len(values) == len(mesh.cells)
        }
        cells = (
            ("tetra", mesh.cells)
            if mesh.cells10 is None or mesh.parent is not None
            else ("tetra10", mesh.cells10)
        )
        return meshio.Mesh(
            self.positions(k),
            [cells],
            cell_data=on_cells,
            point_data={name: values for name, values in fields.items() if name not in on_cells},
        )

    def to_pyvista(self, k: int = -1) -> Any:
        """A pyvista.UnstructuredGrid of a frame, likewise."""
        pyvista = needed("pyvista", "to_pyvista")
        needed("meshio", "to_pyvista")
        return pyvista.from_meshio(self.to_meshio(k))


def colour_range(samples: Sequence[numpy.ndarray]) -> tuple[float, float]:
    """Ends (low, high) of a scale of colours for arrays of values: a few singular spots, at edges
    and supports, do not decide it."""
    values = numpy.concatenate(samples)
    values = values[numpy.isfinite(values)]
    if len(values) == 0:
        return 0.0, 1.0
    low, high = numpy.percentile(values, [0.7, 99.3])
    if high - low <= 1e-12 * numpy.abs(values).max():
        # nearly all are alike, as forces of contact that are zero but at a few points: the others
        # decide
        common = numpy.median(values)
        others = values[numpy.abs(values - common) > 1e-12 * numpy.abs(values).max()]
        if len(others):
            low, high = numpy.percentile(numpy.append(others, common), [0.7, 99.3])
            low, high = min(low, common), max(high, common)
    if low >= 0 and low < 0.3 * high:
        low = 0.0
    elif low < 0 < high:
        low, high = -max(high, -low), max(high, -low)
    if high - low <= 1e-12 * max(abs(high), abs(low)):
        middle = (high + low) / 2
        return (middle - 0.5 * abs(middle), middle + 0.5 * abs(middle)) if middle else (0.0, 1.0)
    return low, high
