"""What scripts/accuracy is made of: the scenes, runs of bin/supple and what they cost, points of a problem and the section that shows them."""
import csv
import hashlib
import json
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy

from measure import TOP, Plot, box_mesh, digest, environment, front, gmsh, table

NAMES = {"p1": "P1", "p2": "P2", "cr": "CR", "dg": "DG"}
COLOURS = {"p1": "#b3541e", "cr": "#1f5fa8", "dg": "#2a8a57", "p2": "#8a4fa8"}
PALETTE = ("#b3541e", "#1f5fa8", "#2a8a57", "#8a4fa8", "#777777", "#c2185b", "#00838f")
SHORT, REPEATS = 1.0, 2  # CPU seconds below which a run is repeated, and how often it runs then
LIMIT = 900  # seconds on the clock that a run may take
BLOWN = 10.0  # relative error at which a run counts as blown up
LEVELS = (0.1, 0.03, 0.01, 0.003, 0.001)

# ---------------------------------------------------------------- scenes

END = 0.5  # s, of the swinging bar where it is compared with itself
LOW = 0.25  # s, of the swinging bar where meshes are compared: later P1 is too stiff to fold at the clamp, and finer CR folds as it likes
HERTZ = {"young": 1e5, "poisson": 0.3, "radius": 10.0, "contact": 0.12}  # Pa, 1, m, m


def hertz_force():
    """Force on a rigid sphere pressed into a half-space (Hertz 1882; Johnson, Contact Mechanics, 1985, ch. 4), N."""
    depth = HERTZ["contact"] ** 2 / HERTZ["radius"]
    return 4 / 3 * HERTZ["young"] / (1 - HERTZ["poisson"] ** 2) * math.sqrt(HERTZ["radius"]) * depth**1.5


def hertz_scene():
    """
    A quarter of a block of 1 m under a rigid sphere of 10 m. Its far faces move as a half-space does under the force at a point (Boussinesq), which is what
    the finite block leaves out; it is a twentieth of the sphere's approach there.
    """
    young, nu = HERTZ["young"], HERTZ["poisson"]
    depth = HERTZ["contact"] ** 2 / HERTZ["radius"]
    c, r = hertz_force() * (1 + nu) / (2 * math.pi * young), "sqrt(x^2+y^2+z^2)"
    side = f"{c:.15g}*(abs(z)/{r}^3-{1 - 2 * nu:.15g}/({r}*({r}+abs(z))))"
    return f"""-bodies block
-body_block_material linear
-body_block_young {young:g}
-body_block_poisson {nu:g}
-sets x0,y0,meet,ax,ay,az
-set_x0_at plane:1,0,0,0
-set_y0_at plane:0,1,0,0
-set_meet_at plane:0,0,1,0
-set_ax_at box:1,0,-1,1,1,0
-set_ay_at box:0,1,-1,1,1,0
-set_az_at plane:0,0,1,-1
-effects x,y,far,ball
-effect_x_type fixed
-effect_x_on x0
-effect_x_components x
-effect_y_type fixed
-effect_y_on y0
-effect_y_components y
-effect_far_type prescribed_displacement
-effect_far_on ax,ay,az
-effect_far_displacement x*{side};y*{side};-{c:.15g}*({2 * (1 - nu):.15g}/{r}+z^2/{r}^3)
-effect_ball_type contact
-effect_ball_on meet
-effect_ball_response projected
-effect_ball_obstacle sphere:0,0,{HERTZ["radius"] - depth:.15g},{HERTZ["radius"]:g}
-time static
"""


SCENES = {
    "bar": """-bodies bar
-body_bar_material linear
-body_bar_young 5e4
-body_bar_density 1000
-effects gravity,clamp
-effect_gravity_vector 0,0,-9.81
-effect_clamp_type fixed
-effect_clamp_on xmin
-time static
-probes end
-probe_end_at 0.4,0.05,0.05
""",
    "cook": """-bodies plate
-body_plate_material linear
-body_plate_young 1
-body_plate_density 1
-effects hold,plane,pull
-effect_hold_type fixed
-effect_hold_on left
-effect_plane_type fixed
-effect_plane_on all
-effect_plane_components z
-effect_pull_type traction
-effect_pull_on right
-effect_pull_vector 0;1/16;0
-time static
-probes corner
-probe_corner_at 48,60,0
""",
    "swing": """-bodies bar
-body_bar_material corotated
-body_bar_young 1e5
-body_bar_poisson 0.4
-body_bar_density 1000
-effects gravity,clamp
-effect_gravity_vector 0,0,-9.81
-effect_clamp_type fixed
-effect_clamp_on xmin
-probes end
-probe_end_at 0.4,0.05,0.05
""",
    "hertz": hertz_scene(),
    "drop": """-bodies block
-body_block_mesh box:0.1,0.1,0.1:4
-body_block_rotate 1,1,0,25
-body_block_translate 0,0,0.1
-body_block_material corotated
-body_block_young 2e4
-body_block_poisson 0.4
-body_block_density 1000
-effects gravity,floor
-effect_floor_type contact
-effect_floor_obstacle plane:0,0,1,0
-effect_floor_response projected
-ts_max_time 0.35
""",
}

# Displacement of the end of the static bar, and of the corner of Cook's membrane, in m, by Poisson's ratio: elements of high order on
# graded hexahedra, checked with another program (docs/reports/verification.md names both scenes); 1e-5 and 2e-5 of it.
BAR = {0.3: -0.785713, 0.49: -0.762295, 0.4999: -0.760458}
COOK = {1 / 3: 22.6106, 0.49: 19.6653, 0.4999: 19.4285}
# Displacement (x, z) of the end of the swinging bar at LOW, m: CR, Newmark, Newton, on 8 and 4 cells across with steps of 5 ms, extrapolated with order 2 in
# space, and what an eighth of the step changes on 4 cells; 4 and 6 cells give the same up to 1e-4 of it. `scripts/accuracy --references` computes it again.
SWING_END = (-0.142925, -0.303432)

RECIPE = "-time newmark -body_bar_tangent exact_spd -snes_type ksponly -time_predictor velocity"


# ---------------------------------------------------------------- runs


class Run:
    """One run of bin/supple: what it was asked for and, once Lab.measure() came by, what it cost and where its results are."""

    def __init__(self, lab, scene, options, ranks, fields):
        self.scene, self.ranks = scene, ranks
        output = "displacement,velocity -output_precision double -output_every_steps 1000000" if fields and scene in ("swing", "drop") else \
            "displacement -output_precision double" if fields else "none"
        self.options = f"{lab.place}/{scene}.opts {options} -output_fields {output} -quiet"
        launcher = f"scripts/mpi {ranks} " if ranks > 1 else ""
        self.command = f"{launcher}bin/supple {self.options}"
        self.folder = lab.work / "runs" / hashlib.sha256(self.command.encode()).hexdigest()[:16]
        self.facts = None

    def history(self):
        """{column: [values]}"""
        with open(self.folder / "history.csv", newline="") as f:
            rows = list(csv.DictReader(line for line in f if not line.startswith("#")))
        return {name: [float(row[name]) for row in rows] for name in rows[0]}

    def last(self, column):
        return self.history()[column][-1]

    def field(self, name):
        """A field of the last frame, [vertices][3], in the order of the mesh."""
        with h5py.File(self.folder / "fields.h5") as f:
            frame = max((g for group in f["step"].values() for g in group.values()), key=lambda g: g.attrs["time"])
            return frame[name][()]


class Lab:
    """Collects runs, does them, keeps what they said."""

    def __init__(self, build, quick, again, jobs):
        self.quick, self.jobs = quick, jobs
        self.work = Path(build).resolve() / "accuracy"
        if again:
            shutil.rmtree(self.work, ignore_errors=True)
        self.work.mkdir(parents=True, exist_ok=True)
        self.place = os.path.relpath(self.work, TOP)
        self.program = digest(TOP / "bin/supple")
        self.runs, self.failed, self.lock = {}, [], threading.Lock()
        for name, text in SCENES.items():
            (self.work / f"{name}.opts").write_text(f"# {name}.opts - written by scripts/accuracy\n{text}")

    def run(self, scene, options, ranks=1, fields=False):
        new = Run(self, scene, options, ranks, fields)
        return self.runs.setdefault(new.command, new)

    def cook_mesh(self, size):
        return os.path.relpath(gmsh(TOP / "meshes/cook.geo", self.work / f"cook_{size:g}.msh", size=size), TOP)

    def hertz_mesh(self, n):
        """Cells at the contact a quarter of the mean size."""
        at = lambda t: 0.25 * t + 0.75 * t**6
        path = self.work / f"hertz_{n}.msh"
        return os.path.relpath(path if path.exists() else box_mesh(path, (n, n, n), lambda i, j, k: (at(i / n), at(j / n), -at(1 - k / n))), TOP)

    def measure(self):
        """Does all runs that were asked for: those on one rank side by side, then those on several."""
        todo = [r for r in self.runs.values() if r.facts is None]
        with ThreadPoolExecutor(self.jobs) as pool:
            list(pool.map(self.do, [r for r in todo if r.ranks == 1]))
        for run in todo:
            if run.ranks > 1:
                self.do(run)

    def do(self, run):
        kept = run.folder / "measured.json"
        if kept.exists():
            run.facts = json.loads(kept.read_text())
            if run.facts.pop("program") == self.program:
                return
        run.facts, seconds = None, math.inf
        for _ in range(REPEATS):
            told = self.once(run)
            if told is None:
                return
            seconds = min(seconds, told["cpu_seconds_max"])
            if self.quick or seconds > SHORT:
                break
        facts = {
            "seconds": seconds,
            "unknowns": told["unknowns"],
            "memory": told["memory_max_bytes"] / 1e6,
            "tets": sum(b["tets"] for b in told["bodies"]),
            **{k: told[k] for k in ("steps", "solver")},
            "newton": told["newton_iterations"],
            "linear": told["linear_iterations"],
            "rejected": told["rejected_steps"],
        }
        kept.write_text(json.dumps({"program": self.program, **facts}))
        run.facts = facts
        with self.lock:
            print(f"{seconds:8.2f} s  {run.command}", flush=True)

    def once(self, run):
        """run.json of a run that ended well; None otherwise, and the failure is kept."""
        shutil.rmtree(run.folder, ignore_errors=True)
        command = [str(TOP / "scripts/mpi"), str(run.ranks), str(TOP / "bin/supple"), *shlex.split(run.options), "-output_dir", str(run.folder)]
        # a rank that waits for another one lets it have its core; one that is alone must not
        env = environment(**({"OMPI_MCA_mpi_yield_when_idle": "1"} if run.ranks > 1 else {}))
        try:
            done = subprocess.run(command, capture_output=True, text=True, cwd=TOP, timeout=LIMIT, env=env)
            text = (done.stdout + done.stderr).strip()
        except subprocess.TimeoutExpired:
            done, text = None, f"no end after {LIMIT} s"
        told = json.loads((run.folder / "run.json").read_text()) if done and not done.returncode else {}
        if told.get("status") != "completed":
            with self.lock:
                self.failed.append(run.command)
                print(f"failed: {run.command}: {text[-300:]}", file=sys.stderr, flush=True)
            return None
        return told


class Point:
    """One measured setting of a problem: line in the diagram, label on the line, error."""

    def __init__(self, problem, line, label, run, error, **extra):
        self.problem, self.line, self.label, self.run, self.error, self.extra = problem, line, label, run, error, extra

    def __getattr__(self, name):
        return self.run.facts[name]


def points_of(problem, asked, error):
    """Points of the runs that ended well; error(run) gives the error and more columns. asked: [(line, label, run)]"""
    found = []
    for line, label, run in asked:
        if run.facts:
            value, extra = error(run)
            found.append(Point(problem, line, label, run, value, **extra))
    return found


def relative(value, exact):
    return abs(value / exact - 1)


def distance(run, reference, name="displacement"):
    """Of a field at all vertices, at the end, relative to the reference."""
    exact = reference.field(name)
    return float(numpy.linalg.norm(run.field(name) - exact) / numpy.linalg.norm(exact))


def drift(run):
    """Energy that appeared (or went), at its largest, relative to the largest energy in the body."""
    h = run.history()
    return max(map(abs, h["total"])) / max(k + s for k, s in zip(h["kinetic"], h["strain"]))


# ---------------------------------------------------------------- what a sweep becomes


def number(value):
    return f"{value:.0f}" if value >= 1000 else f"{value:.3g}"


def percent(error):
    return f"{100 * error:.2g} %" if error < 0.995 else f"{100 * error:.0f} %"


def size_of(label):
    """The number in a label: cells, length of edges, step, tolerance; of a word 0."""
    found = re.search(r"\d[\d.e-]*", label)
    return float(found[0]) if found else 0.0


def best_of(points):
    """Of points that cost the same the better one; in the order of their cost."""
    chosen = set(front((p.seconds, p.error) for p in points))
    return sorted((p for p in points if (p.seconds, p.error) in chosen), key=lambda p: p.seconds)


def order(points, sizes):
    """Order of the error between the first and the last of points whose step or cell has these sizes."""
    return math.log(points[0].error / points[-1].error) / math.log(sizes[0] / sizes[-1])


class Sweep:
    """A section of the page: problems with their points, what they should obey, and words."""

    def __init__(self, name, title, intro):
        self.name, self.title, self.intro = name, title, intro
        self.points, self.checks, self.seen, self.tabled, self.axes = [], [], "", None, [("seconds", "CPU seconds", "seconds")]

    def line(self, problem, line):
        return [p for p in self.points if (p.problem, p.line) == (problem, line)]

    def check(self, good, text):
        self.checks.append((bool(good), f"{self.name}: {text}"))

    def check_order(self, problem, line, sizes, low, high):
        found = self.line(problem, line)
        if len(found) != len(sizes):
            return self.check(False, f"{problem}, {line}: {len(found)} of {len(sizes)} runs")
        value = order(found, sizes)
        self.check(low <= value <= high, f"{problem}, {line}: order {value:.2f}, should be in [{low}, {high}]")

    @property
    def problems(self):
        return list(dict.fromkeys(p.problem for p in self.points))

    def plots(self, folder):
        """Writes the diagrams; the Markdown that shows them."""
        shown = []
        for k, problem in enumerate(self.problems):
            for axis, unit, short in self.axes:
                plot = Plot(f"{problem}: error", unit, "relative error", with_front=True)
                for i, line in enumerate(dict.fromkeys(p.line for p in self.points if p.problem == problem)):
                    colour, dash = COLOURS.get(line.lower(), PALETTE[i % len(PALETTE)]), "" if i < len(PALETTE) else "5 3"
                    plot.add(line, colour, dash, [(getattr(p, axis), p.error) for p in self.line(problem, line)])
                name = f"accuracy_{self.name}{k or ''}_{short}.svg"
                plot.write(folder / name)
                shown.append(f"![{problem}, by {short}]({name})")
        return "\n".join(shown)

    def tables(self):
        """A table per problem, of all or of those in self.tabled: error and seconds, a row per line, a column per label; those by size begin with the unknowns, the same in each problem."""
        text = []
        if len(self.axes) > 1 and self.points:
            text.append(self.table("Unknowns", [p for p in self.points if p.problem == self.problems[0]], lambda p: f"{p.unknowns}"))
        for problem in self.problems:
            if self.tabled is not None and problem not in self.tabled:
                continue
            mine = [p for p in self.points if p.problem == problem]
            ahead = best_of(mine)
            text.append(self.table(f"{problem}: error, s", mine, lambda p: f"**{percent(p.error)}**, {number(p.seconds)}" if p in ahead else f"{percent(p.error)}, {number(p.seconds)}"))
        return "\n".join(text)

    def table(self, head, points, cell):
        lines = {line: {p.label: p for p in points if p.line == line} for line in dict.fromkeys(p.line for p in points)}
        longest = max(lines.values(), key=len)
        sizes = [size_of(label) for label in longest]
        sign = -1 if sizes[0] > sizes[-1] else 1
        labels = sorted({p.label for p in points}, key=lambda label: (not label, sign * size_of(label), label))
        return table([head, *labels], [[line, *(cell(found[label]) if label in found else "" for label in labels)] for line, found in lines.items()])

    def text(self, folder):
        parts = (self.intro, self.plots(folder), self.tables().rstrip("\n"), self.seen)
        return f"## {self.title}\n\n" + "\n\n".join(part for part in parts if part) + "\n"
