"""What the scripts that measure share: the machine, results that are kept, meshes, tables, diagrams, marked parts of documents.

Used by scripts/accuracy, bench, locking and solvers. Python's standard library is enough.
"""
import csv
import hashlib
import json
import math
import os
import re
import subprocess
import threading
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent

# ---------------------------------------------------------------- machine and runs


def machine():
    """Model of the processor and number of cores, and a name for the folder of the results."""
    model = "unknown processor"
    for line in Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []:
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    cores = len(os.sched_getaffinity(0))
    return model, cores, f"{re.sub(r'[^a-z0-9]+', '-', model.lower()).strip('-')}-{cores}-cores"


def environment(**more):
    """That of a measured run: one thread per rank."""
    return dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", **more)


def digest(program):
    """What tells one build of a program from another."""
    return hashlib.sha256(Path(program).read_bytes()).hexdigest()


class Results:
    """Facts of runs by a key, kept in a file as long as the program stays the same. Threads may share one."""

    def __init__(self, file, program, again):
        self.file, self.lock = Path(file), threading.Lock()
        self.file.parent.mkdir(parents=True, exist_ok=True)
        self.known = {} if again or not self.file.exists() else json.loads(self.file.read_text())
        mark = digest(program)
        if self.known.get("program") != mark:
            self.known = {"program": mark}

    def get(self, key):
        with self.lock:
            return self.known.get(key)

    def put(self, key, facts):
        with self.lock:
            self.known[key] = facts
            self.file.write_text(json.dumps(self.known, indent=0))


# ---------------------------------------------------------------- meshes


def gmsh(geo, path, **numbers):
    """Meshes a .geo file into `path` unless that is there; numbers replace those of the file."""
    if not path.exists():
        new = path.with_suffix(".tmp")
        given = [w for name, value in numbers.items() for w in ("-setnumber", name, f"{value:g}")]
        subprocess.run(["gmsh", "-3", "-format", "msh41", *given, "-o", new, geo], check=True, stdout=subprocess.DEVNULL)
        new.rename(path)
    return path


def box_mesh(path, size, place):
    """A box of size[0] x size[1] x size[2] cells, each cut into six tets along one diagonal; place(i, j, k) gives the coordinates of a vertex."""
    number = lambda i, j, k: 1 + i + (size[0] + 1) * (j + (size[1] + 1) * k)
    nodes = [place(i, j, k) for k in range(size[2] + 1) for j in range(size[1] + 1) for i in range(size[0] + 1)]
    around = ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))  # six tets on the diagonal 0-7 of a cell
    tets = []
    for k in range(size[2]):
        for j in range(size[1]):
            for i in range(size[0]):
                v = [number(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)) for c in range(8)]
                tets += [(v[0], v[a], v[b], v[7]) for a, b in around]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(nodes))]
    lines += [f"{i} {x[0]:.17g} {x[1]:.17g} {x[2]:.17g}" for i, x in enumerate(nodes, 1)]
    lines += ["$EndNodes", "$Elements", str(len(tets))]
    lines += [f"{e} 4 2 1 1 {t[0]} {t[1]} {t[2]} {t[3]}" for e, t in enumerate(tets, 1)]
    path.write_text("\n".join(lines + ["$EndElements"]) + "\n")
    return path


# ---------------------------------------------------------------- documents


def table(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(r) + " |" for r in rows]) + "\n"


def marked(text, name):
    """The part of a document between <!-- NAME begin --> and <!-- NAME end -->; None when they are not there once each."""
    found = re.findall(rf"<!-- {name} begin -->\n(.*?)<!-- {name} end -->", text, re.S)
    return found[0] if len(found) == 1 else None


def replace_marked(path, name, text):
    """Puts `text` between the marks of a document; ends the program when they are not there."""
    old = path.read_text()
    if marked(old, name) is None:
        raise SystemExit(f"{path}: the marks <!-- {name} begin --> and <!-- {name} end --> are not there once: put them where the text belongs")
    path.write_text(re.sub(rf"(<!-- {name} begin -->\n).*?(<!-- {name} end -->)", lambda m: m[1] + text + m[2], old, flags=re.S))


def write_csv(path, fields, rows):
    """Rows of {field: value}; floats with six digits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="") as f:
        writer = csv.DictWriter(f, fields, lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})


# ---------------------------------------------------------------- diagrams


def front(points):
    """The Pareto front of (x, y) pairs, smaller being better in both, from the smallest x on."""
    best, found = math.inf, []
    for x, y in sorted(points):
        if y < best:
            best = y
            found.append((x, y))
    return found


class Plot:
    """A diagram with logarithmic axes, written as SVG. Curves: (label, colour, dash, [(x, y)]); the Pareto front of them all is drawn when asked for."""

    WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 520, 360, 62, 46, 30, 128

    def __init__(self, title, x, y, with_front=False):
        self.title, self.x, self.y, self.curves, self.with_front = title, x, y, [], with_front

    def add(self, label, colour, dash, points):
        points = [(a, b) for a, b in points if a > 0 and b > 0]
        if points:
            self.curves.append((label, colour, dash, points))

    def write(self, path):
        xs = [p[0] for c in self.curves for p in c[3]]
        ys = [p[1] for c in self.curves for p in c[3]]
        lx, ly = self.limits(xs), self.limits(ys)
        w, h = self.WIDTH - self.LEFT - self.RIGHT, self.HEIGHT - self.TOP - self.BOTTOM
        width = max(self.WIDTH, self.LEFT + w + 42 + 6 * max(len(c[0]) for c in self.curves))

        def at(x, y):
            return (
                self.LEFT + w * (math.log10(x) - lx[0]) / (lx[1] - lx[0]),
                self.TOP + h * (1 - (math.log10(y) - ly[0]) / (ly[1] - ly[0])),
            )

        out = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {self.HEIGHT}" font-family="sans-serif" font-size="11">',
            f'<rect width="{width}" height="{self.HEIGHT}" fill="#fff"/>',
            f'<text x="{self.LEFT}" y="18" font-size="13">{self.title}</text>',
            f'<text x="{self.LEFT + w / 2}" y="{self.HEIGHT - 10}" text-anchor="middle">{self.x}</text>',
            f'<text x="14" y="{self.TOP + h / 2}" text-anchor="middle" transform="rotate(-90 14 {self.TOP + h / 2})">{self.y}</text>',
        ]
        for axis, (low, high) in enumerate((lx, ly)):
            for value in self.ticks(low, high):
                px, py = at(value, 10 ** ly[0]) if axis == 0 else at(10 ** lx[0], value)
                qx, qy = (px, self.TOP) if axis == 0 else (self.LEFT + w, py)
                out.append(f'<line x1="{px:.1f}" y1="{py:.1f}" x2="{qx:.1f}" y2="{qy:.1f}" stroke="#ddd"/>')
                where = f'x="{px:.1f}" y="{py + 15:.1f}" text-anchor="middle"' if axis == 0 else f'x="{px - 5:.1f}" y="{py + 4:.1f}" text-anchor="end"'
                out.append(f"<text {where}>{value:g}</text>")
        out.append(f'<rect x="{self.LEFT}" y="{self.TOP}" width="{w}" height="{h}" fill="none" stroke="#555"/>')
        if self.with_front:
            pixels = [at(*p) for p in front(p for c in self.curves for p in c[3])]
            out.append(f'<polyline fill="none" stroke="#f2c14e" stroke-width="7" stroke-linejoin="round" opacity="0.55" points="{" ".join(f"{a:.1f},{b:.1f}" for a, b in pixels)}"/>')
            out += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="5.5" fill="none" stroke="#b8860b" stroke-width="1.3"/>' for a, b in pixels]
        for k, (label, colour, dash, points) in enumerate(self.curves):
            pixels = [at(*p) for p in points]
            style = f'stroke-dasharray="{dash}"' if dash else ""
            out.append(f'<polyline fill="none" stroke="{colour}" stroke-width="1.8" {style} points="{" ".join(f"{a:.1f},{b:.1f}" for a, b in pixels)}"/>')
            out += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="2.6" fill="{colour}"/>' for a, b in pixels]
            ypos = self.TOP + 12 + 17 * k
            out.append(f'<line x1="{self.LEFT + w + 8}" y1="{ypos - 4}" x2="{self.LEFT + w + 30}" y2="{ypos - 4}" stroke="{colour}" stroke-width="1.8" {style}/>')
            out.append(f'<text x="{self.LEFT + w + 34}" y="{ypos}">{label}</text>')
        path.write_text("\n".join(out) + "\n</svg>\n")

    @staticmethod
    def limits(values):
        low, high = math.log10(min(values)), math.log10(max(values))
        return low - 0.05 * (high - low) - 0.02, high + 0.05 * (high - low) + 0.02

    @staticmethod
    def ticks(low, high):
        factors = (1, 2, 5) if high - low < 2.6 else (1,)
        found = [f * 10.0**e for e in range(math.floor(low), math.ceil(high) + 1) for f in factors]
        return [v for v in found if low <= math.log10(v) <= high]
