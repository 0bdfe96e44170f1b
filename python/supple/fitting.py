"""Constants of a law from tests of a material: tables of stretch and nominal stress, of one mode or of several together. Needs scipy.

    points = read_points(["rubber.csv"], unit="MPa")
    found = fit_law(points, "ogden", terms=3)
    found.law.option_lines("band"), found.errors["planar"], found.ranges["uniaxial"]

Minimised is sum w_i (P(x_i) - P_i)^2 / s_i^2 over all points, w_i their weights and s_i by `errors`:

    relative    |P_i|: each point counts by its error in percent
    mode        root mean square of the stresses of the mode: modes count alike, and large stresses more than small ones
    absolute    1 Pa: modes with large stresses count most

Given alpha of ogden, jm of gent or lambda_m of arruda_boyce, the stress is linear in the other constants: these come from linear least squares within
the iteration for the former (variable projection, Golub and Pereyra 1973), which starts at many points of a fixed seed. The shear modulus at rest is positive; with
`stable` every term is (mu_i alpha_i > 0, c_pq >= 0): then Drucker's condition holds at every stretch, of ogden and yeoh.
"""
import csv
import math
from pathlib import Path

import numpy
from scipy.optimize import least_squares, nnls

from .laws import MODES, Law, family, no_such, strains
from .run import RunError

UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6}
ALIASES = {"biaxial": "equibiaxial", "pure_shear": "planar", "simple_shear": "shear", "tension": "uniaxial"}
STARTS = 24  # of ogden's exponents: 6 end where 96 do, for Treloar's rubber (2 to 4 terms) and the cortex (2 and 3)
LARGEST = 60.0  # exponent of ogden that is tried: stresses double within 1.2 % of stretch
SMALLEST = 1e-2  # exponent of ogden that is written; below it mu is large and the law that of the logarithms
SHOWN = ("uniaxial", "equibiaxial", "planar", "shear")  # modes of the ranges
RANGE = (0.3, 3.0)  # stretches in which the program looks for instability: src/material/stability.c


class Points:
    """Points of tests: mode [n] names, x [n] stretches or amounts of shear, stress [n] Pa, weight [n]."""

    def __init__(self, mode, x, stress, weight=None):
        self.mode, self.x, self.stress = numpy.asarray(mode), numpy.asarray(x, dtype=float), numpy.asarray(stress, dtype=float)
        self.weight = numpy.ones(len(self.x)) if weight is None else numpy.asarray(weight, dtype=float)

    def __len__(self):
        return len(self.x)

    @property
    def modes(self):
        return [mode for mode in MODES if (self.mode == mode).any()]


def mode_of(word, where):
    name = word.strip().lower().replace(" ", "_").replace("-", "_")
    name = ALIASES.get(name, name)
    if name not in MODES:
        raise RunError(f"{where}: {no_such('mode', word.strip(), MODES)}")
    return name


def number_of(word, what, where):
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RunError(f"{where}: {what} '{word.strip()}' is not a number")
    return value


def read_table(path, mode):
    """(where, mode, x, stress, weight) of each row of a file; mode: of all rows, or None where the file has a column of it."""
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as e:
        raise RunError(f"{path} cannot be read: {getattr(e, 'strerror', None) or 'it is not a text'}") from None
    columns = (["mode"] if mode is None else []) + ["stretch", "stress", "weight"]
    first = True
    for n, line in enumerate(lines, 1):
        words = next(csv.reader([line.partition("#")[0]]), [])
        where = f"{path}, line {n}"
        if not any(word.strip() for word in words):
            continue
        names = [word.strip().lower() for word in words]
        if first and "stress" in names:
            columns = ["stretch" if name == "shear" else name for name in names]
            missing = [name for name in ["mode"] * (mode is None) + ["stretch", "stress"] if name not in columns]
            unknown = [name for name in columns if name not in ("mode", "stretch", "stress", "weight")]
            if missing or unknown:
                raise RunError(f"{where}: " + (f"no column {missing[0]}" if missing else f"column {unknown[0]} is unknown") + " (columns: mode, stretch or shear, stress, weight)")
        else:
            row = dict(zip(columns, words))
            if len(words) > len(columns) or "stress" not in row or (mode is None and "mode" not in row):
                raise RunError(f"{where}: {len(words)} values; expected {', '.join(columns)}, the weight may be left out")
            of_row = mode_of(row["mode"], where) if mode is None else mode
            yield (where, of_row, number_of(row["stretch"], MODES[of_row][0], where), number_of(row["stress"], "stress", where),
                   number_of(row.get("weight") or "1", "weight", where))
        first = False


def read_points(files, unit="Pa"):
    """Points of files: FILE with a column mode, or MODE=FILE without one."""
    if unit not in UNITS:
        raise RunError(no_such("unit", unit, UNITS))
    rows = []
    for name in files:
        mode, equals, path = str(name).partition("=")
        mode, path = (mode_of(mode, name), path) if equals and not Path(name).exists() else (None, name)
        before = len(rows)
        for where, of_row, x, stress, weight in read_table(path, mode):
            if of_row != "shear" and x <= 0:
                raise RunError(f"{where}: a stretch is length over length at rest, above 0; it is {x:g}")
            if of_row == "compression" and x > 1:
                raise RunError(f"{where}: stretches of compression are below 1; it is {x:g}")
            if weight < 0:
                raise RunError(f"{where}: a weight is 0 or more; it is {weight:g}")
            rows.append((of_row, x, stress * UNITS[unit], weight))
        if len(rows) == before:
            raise RunError(f"{path} has no points")
    points = Points(*zip(*rows))
    pressed = (points.mode == "compression") & (points.stress != 0)
    if pressed.any() and (points.stress[pressed] > 0).all():
        raise RunError("all stresses of compression are positive: a stress that presses is negative")
    return points


class Fit:
    """What was found.

    law      - Law
    errors   - {mode: {points, rms (Pa), of_largest (rms over the largest stress), percent (mean of |P - P_i|/|P_i|), R2}}, and "all"
    ranges   - {mode: {low, high, stable (from, to), rising (from, to)}}: where Drucker's condition holds, and where the nominal stress rises,
               as far as it was looked at
    """

    def __init__(self, law, points):
        self.law, self.points = law, points
        self.found = numpy.empty(len(points))
        for mode in points.modes:
            chosen = points.mode == mode
            self.found[chosen] = law.nominal_stress(mode, points.x[chosen])
        self.errors = {mode: self.errors_of(points.mode == mode) for mode in points.modes} | {"all": self.errors_of(numpy.ones(len(points), dtype=bool))}
        self.ranges = {}
        for mode in SHOWN:
            tested = points.x[(points.mode == mode) | ((mode == "uniaxial") & (points.mode == "compression"))]
            if mode == "shear":
                low, high = 0.0, max([RANGE[1] - 1 / RANGE[1], *abs(tested)])
            else:
                low, high = min([RANGE[0], *tested]), max([RANGE[1], *tested])
            self.ranges[mode] = {"low": float(low), "high": float(high), "stable": law.stable(mode, low, high), "rising": law.rising(mode, low, high)}

    def errors_of(self, chosen):
        stress, off = self.points.stress[chosen], (self.found - self.points.stress)[chosen]
        rms, spread, known = math.sqrt((off**2).mean()), ((stress - stress.mean()) ** 2).sum(), stress != 0
        return {"points": len(stress), "rms": rms, "of_largest": rms / abs(stress).max() if known.any() else math.nan,
                "percent": 100 * float(abs(off[known] / stress[known]).mean()) if known.any() else math.nan,
                "R2": float(1 - (off**2).sum() / spread) if spread > 0 else math.nan}


def error_scales(points, errors):
    """s_i [n], Pa."""
    if errors == "absolute":
        return numpy.ones(len(points))
    if errors == "mode":
        size = {mode: math.sqrt((points.stress[points.mode == mode] ** 2).mean()) for mode in points.modes}
        return numpy.array([size[mode] or 1.0 for mode in points.mode])
    if errors == "relative":
        if not points.stress.all():
            raise RunError("a stress is 0 away from rest: its relative error is infinite; take the errors of the mode, or absolute ones")
        return abs(points.stress)
    raise RunError(no_such("kind of error", errors, ("relative", "mode", "absolute")))


def solve_scales(A, b, moduli, positive):
    """Constants c of least |A c - b|, each of the sign of its modulus if `positive`; columns are brought to length 1 before."""
    length = numpy.linalg.norm(A, axis=0)
    length[length == 0] = 1
    return (nnls(A / length, b)[0] if positive else numpy.linalg.lstsq(A / length, b, rcond=1e-10)[0]) / length


def shape_variables(fam, points):
    """The unknown constants z of the iteration: (shape of z, starts, bounds), none where the stress is linear in all constants."""
    n = len(fam.shapes)
    if fam.name == "gent":
        # jm above all x1 of the tests
        x1 = max(numpy.expm1(2 * strains(mode, points.x[points.mode == mode])[0]).sum(axis=0).max() for mode in points.modes)
        return lambda z: x1 * (1 + numpy.exp(z)), [[-6.0], [-3.0], [0.0], [3.0]], (-14, 14)
    if fam.name == "arruda_boyce":
        return lambda z: 1 + numpy.exp(z), [[-1.0], [0.0], [1.0], [2.0]], (-7, 7)
    random = numpy.random.default_rng(1)
    starts = random.choice([-1, 1], (STARTS, n)) * numpy.exp(random.uniform(math.log(0.5), math.log(LARGEST / 2), (STARTS, n)))
    return lambda z: z, starts, (-LARGEST, LARGEST)


def fit_law(points, law, terms=None, errors="relative", stable=False):
    """Fits a law, of so many terms, to Points. Returns a Fit; RunError where there are too few points, or no constants have a positive shear modulus."""
    fam = family(law, terms)
    rest = numpy.array([MODES[mode][1] for mode in points.mode])
    used = ((points.x != rest) | (points.stress != 0)) & (points.weight > 0)
    points = Points(points.mode[used], points.x[used], points.stress[used], points.weight[used])
    distinct = len({("planar" if mode == "shear" else "uniaxial" if mode == "compression" else mode, x) for mode, x in zip(points.mode, points.x)})
    if distinct < max(fam.nconstant, 1):
        raise RunError(f"{law} with {len(fam.scales)} terms has {fam.nconstant} constants, and there are {distinct} points away from rest: fewer terms, or more points")

    factor = numpy.sqrt(points.weight) / error_scales(points, errors)
    b = points.stress * factor
    positive = stable or fam.name not in ("mooney_rivlin", "yeoh", "ogden")

    def system(shape):
        A = numpy.empty((len(points), len(fam.scales)))
        for mode in points.modes:
            chosen = points.mode == mode
            A[chosen] = fam.responses(shape, mode, points.x[chosen]).T
        return A * factor[:, None]

    def of_shape(shape):
        A = system(shape)
        scale = solve_scales(A, b, fam.moduli(shape), positive)
        return scale, A @ scale - b

    # the best of all starts that has a positive shear modulus
    best = None
    if fam.shapes:
        shape_of, starts, bounds = shape_variables(fam, points)
        ends = [least_squares(lambda z: of_shape(shape_of(z))[1], z, bounds=bounds, max_nfev=100).x for z in starts]
        shapes = [numpy.where(abs(s) < SMALLEST, SMALLEST, s) for s in map(shape_of, ends)]
    else:
        shapes = [numpy.empty(0)]
    for shape in shapes:
        scale, off = of_shape(shape)
        if fam.moduli(shape) @ scale > 0 and (best is None or off @ off < best[0]):
            best = off @ off, scale, shape
    if best is None:
        raise RunError(f"{law}: no constants with a positive shear modulus fit these points: are stresses of stretches above 1 positive, and those below negative? Fewer terms, or stable ones, may do")
    _, scale, shape = best
    if law == "ogden":
        # terms that bear nothing are left out; the largest share of the modulus first
        order = [k for k in numpy.argsort(-abs(scale)) if scale[k]]
        fam, scale, shape = family(law, len(order)), scale[order], shape[order]
    return Fit(Law.of(fam, scale, shape), points)
