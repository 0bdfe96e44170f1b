"""Rigid obstacles of a run as triangles, where they are at a time: from its scenario.opts."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy

from .formula import split_formulas, value_at
from .run import FACES, Run, read_text

# what trimesh may read here; its other formats name further files or hold more than a surface
SURFACES = ("stl", "obj", "ply", "off")
MESH_BYTES = 1 << 32  # largest size of a mesh


def read_gmsh(path: Path) -> tuple[numpy.ndarray, numpy.ndarray]:
    """Vertices of a text file of version 4.1, and the boundary of its tets, or its triangles when
    it has none."""
    lines = iter(read_text(path, MESH_BYTES).splitlines())
    points: dict[int, list[float]] = {}
    cells: dict[int, list[list[int]]] = {2: [], 4: []}
    for line in lines:
        if line == "$Nodes":
            for _ in range(int(next(lines).split()[0])):
                n = int(next(lines).split()[3])
                tags = [int(next(lines)) for _ in range(n)]
                points.update((tag, [float(x) for x in next(lines).split()[:3]]) for tag in tags)
        elif line == "$Elements":
            for _ in range(int(next(lines).split()[0])):
                _, _, kind, n = (int(x) for x in next(lines).split())
                block = [[int(x) for x in next(lines).split()[1:]] for _ in range(n)]
                cells.get(kind, []).extend(block)
    number = {tag: i for i, tag in enumerate(points)}
    tets, triangles = (
        numpy.array([[number[tag] for tag in corners] for corners in cells[kind]])
        for kind in (4, 2)
    )
    if len(tets):
        faces = numpy.concatenate([tets[:, c] for c in FACES])
        _, first, count = numpy.unique(
            numpy.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
        )
        triangles = faces[first[count == 1]]
    return numpy.array(list(points.values())), triangles


def frame_of(axis: numpy.ndarray) -> numpy.ndarray:
    """Two unit vectors at right angles to an axis and to each other, and the unit axis:
    right-handed rows."""
    axis = numpy.asarray(axis, dtype=float) / numpy.linalg.norm(axis)
    side = numpy.cross(axis, numpy.eye(3)[numpy.abs(axis).argmin()])
    side /= numpy.linalg.norm(side)
    return numpy.array([side, numpy.cross(axis, side), axis])


def turned(
    profile: numpy.ndarray | Sequence[tuple[float, float]], axes: numpy.ndarray, spokes: int = 48
) -> tuple[numpy.ndarray, numpy.ndarray]:
    """The surface of revolution of (radius, height) pairs from bottom to top about axes[2]: points,
    triangles seen from outside."""
    n, angle = len(profile), 2 * numpy.pi * numpy.arange(spokes) / spokes
    r, h = numpy.asarray(profile, dtype=float).T
    round_ = numpy.cos(angle)[:, None] * axes[0] + numpy.sin(angle)[:, None] * axes[1]
    x = r[:, None, None] * round_ + h[:, None, None] * axes[2]
    i, j = numpy.meshgrid(numpy.arange(n - 1), numpy.arange(spokes), indexing="ij")
    p, q, s, t = (
        a * spokes + b % spokes for a, b in ((i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1))
    )
    triangles = numpy.concatenate(
        [numpy.stack(c, axis=-1).reshape(-1, 3) for c in ((p, q, t), (p, t, s))]
    )
    x = x.reshape(-1, 3)
    corners = x[triangles]
    area = numpy.linalg.norm(
        numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return x, triangles[area > 1e-12 * area.max()]


class Obstacle:
    """A rigid obstacle: its surface at rest, x [n][3] m and triangles [m][3], and where it is at a
    time.

    Where `displacement` or `angle` is live, the history of the run says where it was. Of a plane a
    piece below the places `reached` [k][3] is made, of a bowl the part deeper than half its radius;
    `up` is a unit vector. Water counts as one, of kind `water`, where its level is a number.
    """

    def __init__(self, run: Run, name: str, reached: numpy.ndarray, up: numpy.ndarray) -> None:
        self.name, self.run = name, run
        self.kind, _, words = (self.option("obstacle", "") or self.level()).partition(":")
        self.x: Any = None
        self.triangles: Any = None
        self.open = self.kind == "bowl"
        if self.kind == "mesh":
            self.read(Path(words.split(",")[0]))
        elif self.kind in ("plane", "water", "bowl", "box", "sphere", "capsule", "cylinder"):
            self.x, self.triangles = getattr(self, self.kind)(
                numpy.array([float(x) for x in words.split(",")]), reached, up
            )

    def option(self, key: str, default: str) -> str:
        return self.run.scenario.get(f"effect_{self.name}_{key}", default)

    def level(self) -> str:
        """The words of the plane of a water line."""
        try:
            level = float(self.option("level", ""))
        except ValueError:
            return ""
        gravity = numpy.array([float(x) for x in self.option("gravity", "0,0,-9.81").split(",")])
        up = -gravity / numpy.linalg.norm(gravity)
        return f"water:{up[0]},{up[1]},{up[2]},{level}"

    def water(
        self, a: numpy.ndarray, reached: numpy.ndarray, up: numpy.ndarray
    ) -> tuple[numpy.ndarray, numpy.ndarray]:
        return self.plane(a, reached, up)

    def plane(
        self, a: numpy.ndarray, reached: numpy.ndarray, up: numpy.ndarray
    ) -> tuple[numpy.ndarray, numpy.ndarray]:
        axes = frame_of(a[:3])
        low, high = (reached @ axes[:2].T).min(axis=0), (reached @ axes[:2].T).max(axis=0)
        margin = 0.1 * (high - low).max()
        low, high = low - margin, high + margin
        corners = numpy.array(
            [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]
        )
        return corners @ axes[:2] + a[3] / numpy.linalg.norm(a[:3]) * axes[2], numpy.array(
            [[0, 1, 2], [0, 2, 3]]
        )

    def bowl(
        self, a: numpy.ndarray, reached: numpy.ndarray, up: numpy.ndarray
    ) -> tuple[numpy.ndarray, numpy.ndarray]:
        dip = numpy.linspace(numpy.pi / 2, numpy.pi / 6, 25)
        x, triangles = turned(
            a[3] * numpy.stack([numpy.cos(dip), -numpy.sin(dip)], axis=1), frame_of(up), 64
        )
        return x + a[:3], triangles[:, ::-1]  # seen from inside

    def box(
        self, a: numpy.ndarray, reached: numpy.ndarray, up: numpy.ndarray
    ) -> tuple[numpy.ndarray, numpy.ndarray]:
        corner = numpy.array([[(k >> c) & 1 for c in range(3)] for k in range(8)])
        quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
        return numpy.where(corner, a[3:6], a[:3]), numpy.array(
            [t for p, q, r, s in quads for t in ((p, q, r), (p, r, s))]
        )

    def sphere(
        self, a: numpy.ndarray, reached: numpy.ndarray, up: numpy.ndarray
    ) -> tuple[numpy.ndarray, numpy.ndarray]:
        return self.capsule(numpy.array([*a[:3], *a[:3], a[3]]), reached, up)

    def capsule(
        self, a: numpy.ndarray, reached: numpy.ndarray, up: numpy.ndarray
    ) -> tuple[numpy.ndarray, numpy.ndarray]:
        length, turn = numpy.linalg.norm(a[3:6] - a[:3]), numpy.linspace(-numpy.pi / 2, 0, 13)
        cap = a[6] * numpy.stack([numpy.cos(turn), numpy.sin(turn)], axis=1)
        top = cap[::-1] * (1, -1) + (0, length)
        x, triangles = turned(
            numpy.concatenate([cap, top[0 if length else 1 :]]),
            frame_of(a[3:6] - a[:3] if length else up),
        )
        return x + a[:3], triangles

    def cylinder(
        self, a: numpy.ndarray, reached: numpy.ndarray, up: numpy.ndarray
    ) -> tuple[numpy.ndarray, numpy.ndarray]:
        length = float(numpy.linalg.norm(a[3:6] - a[:3]))
        x, triangles = turned(
            [(0, 0), (a[6], 0), (a[6], length), (0, length)], frame_of(a[3:6] - a[:3])
        )
        return x + a[:3], triangles

    def read(self, path: Path) -> None:
        if not path.is_file():
            return
        if path.suffix == ".msh":
            x, self.triangles = read_gmsh(path)
        elif path.suffix.lower().lstrip(".") in SURFACES and path.stat().st_size <= MESH_BYTES:
            import trimesh

            # without its name: materials and pictures that it names are not looked for
            with open(path, "rb") as file:
                surface = trimesh.load_mesh(
                    file, file_type=path.suffix.lower().lstrip("."), process=False
                )
            x, self.triangles = numpy.array(surface.vertices), numpy.array(surface.faces)
        else:
            return
        self.x = float(self.option("obstacle_scale", "1")) * x + [
            float(a) for a in self.option("obstacle_at", "0,0,0").split(",")
        ]

    def shift(self, t: float) -> list[float]:
        """[3] m at time t, s."""
        text = self.option("displacement", "0;0;0")
        return (
            [self.live(f"{self.name}_live_{k}", t) for k in "xyz"]
            if text == "live"
            else [
                value_at(one, t, f"-effect_{self.name}_displacement")
                for one in split_formulas(text)
            ]
        )

    def live(self, column: str, t: float) -> float:
        table = self.run.history
        return numpy.interp(t, table["time"], table[column]) if len(table) else 0.0

    def pose(self, t: float) -> numpy.ndarray:
        """[4][4]: turned about its axis, then shifted (m); x at time t (s) is pose @ (x, 1)."""
        centre, axis = (
            [float(x) for x in self.option(*given).split(",")]
            for given in (("axis_point", "0,0,0"), ("axis", "0,0,1"))
        )
        text = self.option("angle", "0")
        angle = math.radians(
            self.live(f"{self.name}_angle_live", t)
            if text == "live"
            else value_at(text, t, f"-effect_{self.name}_angle")
        )
        a = numpy.asarray(axis) / (numpy.linalg.norm(axis) or 1)
        cross = numpy.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
        pose = numpy.eye(4)
        pose[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
        pose[:3, 3] = centre - pose[:3, :3] @ centre + self.shift(t)
        return pose

    def positions(self, t: float) -> numpy.ndarray:
        """Of its points [n][3] m at time t, s."""
        pose = self.pose(t)
        return self.x @ pose[:3, :3].T + pose[:3, 3]


def is_body(run: Run, name: str, word: str) -> bool:
    """Whether a body is of this name, or one of the copies of the body of this name."""
    copy = name[len(word) :] if name.startswith(word) else None
    return copy == "" or bool(
        copy and run.scenario.get(f"body_{word}_copies") and copy.strip("_").isdigit()
    )


def obstacles(run: Run) -> list[Obstacle]:
    """Those of a run that can be drawn, as a list. Files of meshes are looked for from the working
    directory."""
    names, found = run.bodies, []
    up = run.up()
    way = sorted({int(k) for k in numpy.linspace(0, len(run) - 1, min(len(run), 40))})
    for effect in run.scenario.get("effects", "").split(","):
        kind = run.scenario.get(f"effect_{effect}_type") or effect
        if kind != "water" and not run.scenario.get(f"effect_{effect}_obstacle"):
            continue
        words = run.scenario.get(f"effect_{effect}_on", "").split(",")
        mine = [
            k for k, name in enumerate(names) if any(is_body(run, name, word) for word in words)
        ] or range(len(names))
        reached = numpy.concatenate(
            [
                run.positions(k)[
                    numpy.unique(run.mesh(k).cells[numpy.isin(run.mesh(k).body, list(mine))])
                ]
                for k in way
            ]
        )
        obstacle = Obstacle(
            run, effect, reached, numpy.array([0.0, 0.0, 1.0]) if up is None else up
        )
        if obstacle.x is not None:
            found.append(obstacle)
    return found
