"""Constants of a law from tests of a material: tables of stretch and nominal stress, of one mode or
of several together. Needs scipy.

    points = read_points(["rubber.csv"], unit="MPa")
    found = fit_law(points, "ogden", terms=3)
    found.law.option_lines("band"), found.errors["planar"], found.ranges["uniaxial"]

Minimised is sum w_i (P(x_i) - P_i)^2 / s_i^2 over all points, w_i their weights and s_i by
`errors`:

    relative    |P_i|: each point counts by its error in percent
    mode        root mean square of the stresses of the mode: modes count alike, and large stresses
                more than small ones
    absolute    1 Pa: modes with large stresses count most

Given alpha of ogden, jm of gent or lambda_m of arruda_boyce, the stress is linear in the other
constants: these come from linear least squares within the iteration for the former (variable
projection, Golub and Pereyra 1973), which starts at many points of a fixed seed. The shear modulus
at rest is positive; with `stable` every term is (mu_i alpha_i > 0, c_pq >= 0): then Drucker's
condition holds at every stretch, of ogden and yeoh.

The sides of a strip with fibres move as all constants say, and its stress is linear in none. Moduli
and exponents are positive and found by their logarithms, dispersion and angle between their bounds,
by a trust region from the best of many points of a fixed seed; the stress is proportional to all
moduli together, which gives one of them at each of these points.
"""

import csv
import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy
from numpy.typing import ArrayLike
from scipy.optimize import least_squares, nnls

from .fibres import FIBRE_LAWS, Array, FibreFamily, FibreLaw, responses
from .laws import MODES, Family, Law, family, no_such, strains
from .run import RunError

UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6}
ALIASES = {
    "biaxial": "equibiaxial",
    "pure_shear": "planar",
    "simple_shear": "shear",
    "tension": "uniaxial",
}
# of ogden's exponents: 6 end where 96 do, for Treloar's rubber (2 to 4 terms) and the cortex
# (2 and 3)
STARTS = 24
LARGEST = 60.0  # exponent of ogden that is tried: stresses double within 1.2 % of stretch
# exponent of ogden that is written; below it mu is large and the law that of the logarithms
SMALLEST = 1e-2
SHOWN = ("uniaxial", "equibiaxial", "planar", "shear")  # modes of the ranges
RANGE = (0.3, 3.0)  # stretches in which the program looks for instability: src/material/stability.c
# of laws with fibres, whose exponentials soon end all that can be said: as far as the tests in
# logarithms, and half as far again
FARTHER = 1.5
# points at which a law with fibres is evaluated, and the best of them from which it is fitted: with
# noise of 5 % in synthetic tests of three laws these end where 6 of 200 do, and the best one of 200
# alone not always
FIBRE_STARTS = 40
FIBRE_BEST = 3
# what a constant that the tests do not tell is written as: another one, or 0
UNTOLD = {"mu_fibre": "mu", "bfs": "bt"} | {
    f"{letter}_{way}": "" for letter in "ab" for way in ("f", "s", "fs")
}
# correlation of two constants from which on tests do not tell them apart, as of identify.py
ALIKE = 0.999


class Points:
    """Points of tests: mode [n] names, x [n] stretches or amounts of shear, stress [n] Pa, weight
    [n]; with fibres angle [n] degrees, from the fibre to the direction of the test, and across [n],
    the other stretch of biaxial tests, else nan."""

    def __init__(
        self,
        mode: ArrayLike,
        x: ArrayLike,
        stress: ArrayLike,
        weight: ArrayLike | None = None,
        angle: ArrayLike | None = None,
        across: ArrayLike | None = None,
    ) -> None:
        self.mode, self.x, self.stress = (
            numpy.asarray(mode),
            numpy.asarray(x, dtype=float),
            numpy.asarray(stress, dtype=float),
        )
        of_all = lambda values, value: (
            numpy.full(len(self.x), value) if values is None else numpy.asarray(values, dtype=float)
        )
        self.weight, self.angle, self.across = (
            of_all(weight, 1.0),
            of_all(angle, 0.0),
            of_all(across, numpy.nan),
        )

    def __len__(self) -> int:
        return len(self.x)

    def __getitem__(self, chosen: Any) -> "Points":
        return Points(
            self.mode[chosen],
            self.x[chosen],
            self.stress[chosen],
            self.weight[chosen],
            self.angle[chosen],
            self.across[chosen],
        )

    @property
    def modes(self) -> list[str]:
        return [mode for mode in MODES if (self.mode == mode).any()]

    @property
    def groups(self) -> dict[str, tuple[str, float, Array]]:
        """{name: (mode, angle, chosen [n])} of tests of one mode and angle: the mode, with its
        angle where there are several."""
        several = self.angle.any()
        return {
            f"{mode} {angle:g} deg" if several and "_" not in mode else mode: (
                mode,
                float(angle),
                (self.mode == mode) & (self.angle == angle),
            )
            for mode in self.modes
            for angle in sorted(set(self.angle[self.mode == mode]))
        }


def mode_of(word: str, where: str) -> str:
    name = word.strip().lower().replace(" ", "_").replace("-", "_")
    name = ALIASES.get(name, name)
    if name not in MODES:
        raise RunError(f"{where}: {no_such('mode', word.strip(), MODES)}")
    return name


def number_of(word: str, what: str, where: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RunError(f"{where}: {what} '{word.strip()}' is not a number")
    return value


def read_table(path: str | Path, mode: str | None) -> Iterator[tuple[str, dict[str, str]]]:
    """(where, {column: text}) of each row of a file; mode: of all rows, or None where the file has
    a column of it."""
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as e:
        raise RunError(
            f"{path} cannot be read: {getattr(e, 'strerror', None) or 'it is not a text'}"
        ) from None
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
            missing = [
                name
                for name in ["mode"] * (mode is None) + ["stretch", "stress"]
                if name not in columns
            ]
            unknown = [
                name
                for name in columns
                if name not in ("mode", "stretch", "stress", "weight", "angle", "across")
            ]
            if missing or unknown:
                raise RunError(
                    f"{where}: "
                    + (f"no column {missing[0]}" if missing else f"column {unknown[0]} is unknown")
                    + " (columns: mode, stretch or shear, stress, weight, angle, across)"
                )
        else:
            row = dict(zip(columns, words))
            if (
                len(words) > len(columns)
                or "stress" not in row
                or (mode is None and "mode" not in row)
            ):
                raise RunError(
                    f"{where}: {len(words)} values; expected {', '.join(columns)}, the weight may "
                    "be left out"
                )
            yield where, row
        first = False


def of_file(name: str | Path) -> tuple[str | None, float | None, str]:
    """(mode, angle, path) of FILE, MODE=FILE or MODE:ANGLE=FILE; None where the file has columns of
    them."""
    words, equals, path = str(name).partition("=")
    if not equals or Path(name).exists():
        return None, None, str(name)
    mode, colon, angle = words.partition(":")
    return mode_of(mode, str(name)), number_of(angle, "angle", str(name)) if colon else None, path


def read_points(files: Iterable[str | Path], unit: str = "Pa") -> Points:
    """Points of files: FILE with a column mode, or MODE=FILE, MODE:ANGLE=FILE without one."""
    if unit not in UNITS:
        raise RunError(no_such("unit", unit, UNITS))
    rows: list[tuple[str, float, float, float, float, float]] = []
    for name in files:
        mode, angle, path = of_file(name)
        before = len(rows)
        for where, row in read_table(path, mode):
            of_row = mode_of(row["mode"], where) if mode is None else mode
            x, stress, weight = (
                number_of(row["stretch"], MODES[of_row][0], where),
                number_of(row["stress"], "stress", where),
                number_of(row.get("weight") or "1", "weight", where),
            )
            turned = (
                number_of((row.get("angle") or "").strip() or "0", "angle", where)
                if angle is None
                else angle
            )
            across = (
                number_of(row["across"], "stretch across", where)
                if (row.get("across") or "").strip()
                else math.nan
            )
            if MODES[of_row][1] and x <= 0 or across <= 0:
                raise RunError(
                    f"{where}: a stretch is length over length at rest, above 0; it is "
                    f"{min(x, across):g}"
                )
            if of_row == "compression" and x > 1:
                raise RunError(f"{where}: stretches of compression are below 1; it is {x:g}")
            if weight < 0:
                raise RunError(f"{where}: a weight is 0 or more; it is {weight:g}")
            # biaxial tests of equal stretches have a name of their own; other ones are of these two
            # alone
            if of_row == "equibiaxial" and math.isfinite(across):
                of_row = "biaxial"
            elif math.isfinite(across):
                raise RunError(
                    f"{where}: a stretch across is given for biaxial tests only, not for {of_row} "
                    "ones"
                )
            rows.append((of_row, x, stress * UNITS[unit], weight, turned, across))
        if len(rows) == before:
            raise RunError(f"{path} has no points")
    points = Points(*zip(*rows))
    pressed = (points.mode == "compression") & (points.stress != 0)
    if pressed.any() and (points.stress[pressed] > 0).all():
        raise RunError(
            "all stresses of compression are positive: a stress that presses is negative"
        )
    return points


class Fit:
    """What was found.

    law      - Law or FibreLaw
    errors   - {group: {points, rms (Pa), of_largest (rms over the largest stress), percent (mean of
               |P - P_i|/|P_i|), R2}}, and "all"; groups: Points.groups
    ranges   - {group: {low, high, stable (from, to), rising (from, to)}}: where small changes of
               strain do positive work, and where the nominal stress rises,
               as far as it was looked at
    alike    - pairs of constants of a law with fibres that the tests do not tell apart, and single
               ones that they do not tell
    """

    def __init__(
        self, law: Law | FibreLaw, points: Points, alike: Iterable[tuple[str, ...]] = ()
    ) -> None:
        self.law, self.points, self.alike = law, points, list(alike)
        self.found = numpy.empty(len(points))
        for mode, angle, chosen in points.groups.values():
            self.found[chosen] = law.nominal_stress(
                mode, points.x[chosen], angle, points.across[chosen]
            )
        self.errors = {
            name: self.errors_of(chosen) for name, (_, _, chosen) in points.groups.items()
        } | {"all": self.errors_of(numpy.ones(len(points), dtype=bool))}
        self.ranges = {}
        for name, mode, angle, low, high in self.shown():
            self.ranges[name] = {
                "low": float(low),
                "high": float(high),
                "stable": law.stable(mode, low, high, angle),
                "rising": law.rising(mode, low, high, angle),
            }

    def shown(self) -> Iterator[tuple[str, str, float, float, float]]:
        """(name, mode, angle, low, high) of the ranges."""
        if isinstance(self.law, FibreLaw):
            # the largest logarithm of a stretch of all tests, and the largest shear, to both sides
            shears = numpy.array([mode.startswith("shear") for mode in self.points.mode])
            stretches = numpy.concatenate(
                [self.points.x[~shears], self.points.across[numpy.isfinite(self.points.across)]]
            )
            end = math.exp(FARTHER * max([0.0, *abs(numpy.log(stretches))]))
            groups = {
                name: group[:2]
                for name, group in self.points.groups.items()
                if group[0] not in ("biaxial", "compression", "equibiaxial")
            }
            groups |= {
                f"uniaxial {angle:g} deg": ("uniaxial", angle)
                for angle in (0.0, 90.0)
                if ("uniaxial", angle) not in groups.values()
            } | {"equibiaxial": ("equibiaxial", 0.0)}
            for name, (mode, angle) in groups.items():
                if not mode.startswith("shear"):
                    yield name, mode, angle, 1 / end, end
                else:
                    yield (
                        name,
                        mode,
                        angle,
                        0.0,
                        FARTHER * abs(self.points.x[self.points.mode == mode]).max(),
                    )
            return
        for mode in SHOWN:
            tested = self.points.x[
                (self.points.mode == mode)
                | ((mode == "uniaxial") & (self.points.mode == "compression"))
            ]
            if mode == "shear":
                yield mode, mode, 0.0, 0.0, max([RANGE[1] - 1 / RANGE[1], *abs(tested)])
            else:
                yield mode, mode, 0.0, min([RANGE[0], *tested]), max([RANGE[1], *tested])

    def errors_of(self, chosen: Array) -> dict[str, float]:
        stress, off = self.points.stress[chosen], (self.found - self.points.stress)[chosen]
        rms = math.sqrt((off**2).mean())
        spread = ((stress - stress.mean()) ** 2).sum()
        known = stress != 0
        return {
            "points": len(stress),
            "rms": rms,
            "of_largest": rms / abs(stress).max() if known.any() else math.nan,
            "percent": 100 * float(abs(off[known] / stress[known]).mean())
            if known.any()
            else math.nan,
            "R2": float(1 - (off**2).sum() / spread) if spread > 0 else math.nan,
        }


def error_scales(points: Points, errors: str) -> Array:
    """s_i [n], Pa."""
    if errors == "absolute":
        return numpy.ones(len(points))
    if errors == "mode":
        size = numpy.ones(len(points))
        for _, _, chosen in points.groups.values():
            size[chosen] = math.sqrt((points.stress[chosen] ** 2).mean()) or 1.0
        return size
    if errors == "relative":
        if not points.stress.all():
            raise RunError(
                "a stress is 0 away from rest: its relative error is infinite; take the errors of "
                "the mode, or absolute ones"
            )
        return abs(points.stress)
    raise RunError(no_such("kind of error", errors, ("relative", "mode", "absolute")))


def solve_scales(A: Array, b: Array, moduli: Array, positive: bool) -> Array:
    """Constants c of least |A c - b|, each of the sign of its modulus if `positive`; columns are
    brought to length 1 before."""
    length = numpy.linalg.norm(A, axis=0)
    length[length == 0] = 1
    return (
        nnls(A / length, b)[0] if positive else numpy.linalg.lstsq(A / length, b, rcond=1e-10)[0]
    ) / length


def shape_variables(
    fam: Family, points: Points
) -> tuple[Callable[[Array], Array], Any, tuple[float, float]]:
    """The unknown constants z of the iteration: (shape of z, starts, bounds), none where the stress
    is linear in all constants."""
    n = len(fam.shapes)
    if fam.name == "gent":
        # jm above all x1 of the tests
        x1 = max(
            numpy.expm1(
                2
                * strains(mode, points.x[points.mode == mode], points.across[points.mode == mode])[
                    0
                ]
            )
            .sum(axis=0)
            .max()
            for mode in points.modes
        )
        return lambda z: x1 * (1 + numpy.exp(z)), [[-6.0], [-3.0], [0.0], [3.0]], (-14, 14)
    if fam.name == "arruda_boyce":
        return lambda z: 1 + numpy.exp(z), [[-1.0], [0.0], [1.0], [2.0]], (-7, 7)
    random = numpy.random.default_rng(1)
    starts = random.choice([-1, 1], (STARTS, n)) * numpy.exp(
        random.uniform(math.log(0.5), math.log(LARGEST / 2), (STARTS, n))
    )
    return lambda z: z, starts, (-LARGEST, LARGEST)


class Unknowns:
    """The unknown constants z of a law with fibres, with their bounds, and how they give all of its
    constants. families: 1 along the fibre, or 2 at an angle to it, of holzapfel_gasser_ogden;
    fixed: {constant: value}."""

    def __init__(self, family: FibreFamily, families: int, fixed: dict[str, Any]) -> None:
        unknown = [key for key in fixed if key not in family.keys]
        if unknown:
            raise RunError(
                f"{family.name} has no constant {', '.join(unknown)}; it has "
                f"{', '.join(family.keys)}"
            )
        self.family, self.families, self.fixed = family, families, dict(fixed)
        if families == 1:
            self.fixed.setdefault("angles", 0.0)
        self.keys = [key for key in family.keys if key not in self.fixed]
        # exponents from nearly linear to a factor of e within 4 % of stretch; moduli follow the
        # stresses
        ends = {"kappa": (0.0, 1 / 3), "angles": (0.0, 90.0)}
        self.low, self.high = numpy.array(
            [
                ends.get(key, (-40.0, 60.0) if key in family.scales else (-5.0, 8.0))
                for key in self.keys
            ]
        ).T
        # of the steps: logarithms, and parts of the whole of the others
        self.size = numpy.array([{"kappa": 0.1, "angles": 20.0}.get(key, 1.0) for key in self.keys])

    def constants(self, z: ArrayLike) -> dict[str, Any]:
        """Of z [..., nunknown]: arrays [..., 1]."""
        z = numpy.asarray(z)[..., None]
        found: dict[str, Any] = {
            key: numpy.full(z.shape[:-2] + (1,), float(value))
            for key, value in self.fixed.items()
            if key != "angles"
        }
        for k, key in enumerate(self.keys):
            found[key] = z[..., k, :] if key in ("kappa", "angles") else numpy.exp(z[..., k, :])
        if "angles" in self.family.keys:
            angle: Any = found.get("angles", self.fixed.get("angles"))
            if isinstance(angle, (list, tuple)):
                found["angles"] = [float(a) for a in angle]
            else:
                found["angles"] = [angle] if self.families == 1 else [angle, -angle]
        return found

    def starts(self, random: numpy.random.Generator, n: int) -> Array:
        """z [n][nunknown]; moduli within a factor of 30 of each other, some of the exponents small,
        others large."""
        z = random.uniform(0, 1, (n, len(self.keys)))
        for k, key in enumerate(self.keys):
            low, high = {"kappa": (0.0, 1 / 3), "angles": (5.0, 85.0)}.get(
                key, (-3.4, 3.4) if key in self.family.scales else (-1.0, 7.0)
            )
            z[:, k] = low + (high - low) * z[:, k]
        return z


def fit_fibres(
    points: Points, family: FibreFamily, families: int, factor: Array, fixed: dict[str, Any]
) -> Fit:
    """Fits a law with fibres to Points, off by factor [n]."""
    unknowns = Unknowns(family, families, fixed)
    groups = list(points.groups.values())
    b = points.stress * factor
    sides: list[Any] = [None] * len(groups)

    def off(z: Array, remember: bool = False) -> Array:
        """Weighted differences [..., n] of z [..., nunknown]; those of many z begin at the sides
        that one z had."""
        c, r = unknowns.constants(z), numpy.empty(numpy.shape(z)[:-1] + (len(points),))
        for k, (mode, angle, chosen) in enumerate(groups):
            start = (
                None
                if sides[k] is None
                else sides[k].reshape((2,) + (1,) * (numpy.ndim(z) - 1) + (-1,))
            )
            stress, found = responses(
                family, c, mode, points.x[chosen], angle, points.across[chosen], start
            )
            r[..., chosen] = stress * factor[chosen]
            if remember and found is not None:
                sides[k] = found
        return r - b

    def slopes(z: Array) -> Array:
        h = (
            1e-6
            * numpy.maximum(1, unknowns.size)
            * numpy.where(z + 1e-6 * numpy.maximum(1, unknowns.size) < unknowns.high, 1, -1)
        )
        here = off(z, remember=True)
        return ((off(z + numpy.diag(h)) - here) / h[:, None]).T

    # the stress is proportional to the moduli together: with none of them fixed the best factor of
    # each start is known
    z = unknowns.starts(numpy.random.default_rng(1), FIBRE_STARTS)
    scales = [k for k, key in enumerate(unknowns.keys) if key in family.scales]
    if len(scales) == len(family.scales):
        A = off(z) + b
        with numpy.errstate(all="ignore"):
            more = (A @ b) / (A * A).sum(axis=1)
        z = z[more > 0]
        z[:, scales] += numpy.log(more[more > 0])[:, None]
    else:
        z[:, scales] += math.log(abs(points.stress).max())
    cost = (off(z) ** 2).sum(axis=1)
    order = numpy.argsort(numpy.where(numpy.isfinite(cost), cost, numpy.inf))[:FIBRE_BEST]
    best = None
    for start in z[order[numpy.isfinite(cost[order])]]:
        sides[:] = [None] * len(groups)
        start = numpy.clip(
            start, unknowns.low + 1e-9 * unknowns.size, unknowns.high - 1e-9 * unknowns.size
        )
        found = least_squares(
            off,
            start,
            slopes,
            bounds=(unknowns.low, unknowns.high),
            x_scale=unknowns.size,
            xtol=1e-10,
            ftol=1e-12,
            gtol=1e-14,
            max_nfev=100,
        )
        if best is None or found.cost < best.cost:
            best = found
    if best is None:
        raise RunError(
            f"{family.name}: no constants fit these points: are stresses of stretches above 1 "
            "positive, and those below negative?"
        )

    # what the tests do not tell: constants that change nothing, and pairs that do the same
    length = numpy.linalg.norm(best.jac, axis=0) * unknowns.size
    silent = [key for key, one in zip(unknowns.keys, length) if one <= 1e-6 * length.max()]
    told = [k for k, key in enumerate(unknowns.keys) if key not in silent]
    covariance = numpy.linalg.pinv(
        (best.jac[:, told] * unknowns.size[told]).T @ (best.jac[:, told] * unknowns.size[told]),
        rcond=1e-14,
    )
    spread = numpy.sqrt(numpy.diag(covariance))
    alike = [
        (unknowns.keys[i], unknowns.keys[j])
        for m, i in enumerate(told)
        for n, j in enumerate(told[:m])
        if abs(covariance[m, n]) >= ALIKE * spread[m] * spread[n]
    ]
    c = {
        key: [float(numpy.squeeze(a)) for a in value]
        if key == "angles"
        else float(numpy.squeeze(value))
        for key, value in unknowns.constants(best.x).items()
    }
    c |= {key: c.get(UNTOLD[key], 0.0) for key in silent if key in UNTOLD}
    return Fit(FibreLaw(family.name, **c), points, [*((key,) for key in silent), *alike])


def away_from_rest(points: Points, law: str, nscale: int, nconstant: int, turned: bool) -> Points:
    """Those that say something about the law; turned: tests at two angles are two of them. RunError
    where they are fewer than the constants."""
    rest = numpy.array([MODES[mode][1] for mode in points.mode])
    points = points[((points.x != rest) | (points.stress != 0)) & (points.weight > 0)]
    angles = points.angle if turned else 0 * points.angle
    kind = {"shear": "planar", "compression": "uniaxial"}
    distinct = len(
        {
            (kind.get(mode, mode), x, angle, across if across == across else None)
            for mode, x, angle, across in zip(points.mode, points.x, angles, points.across)
        }
    )
    if distinct < max(nconstant, 1):
        raise RunError(
            f"{law} with {nscale} terms has {nconstant} constants, and there are {distinct} points "
            "away from rest: fewer terms, or more points"
        )
    return points


def fit_scales(points: Points, fam: Family, factor: Array, stable: bool) -> Fit:
    """Fits a law of rubber to Points, off by factor [n]."""
    b = points.stress * factor
    positive = stable or fam.name not in ("mooney_rivlin", "yeoh", "ogden")

    def system(shape: Array) -> Array:
        A = numpy.empty((len(points), len(fam.scales)))
        for mode in points.modes:
            chosen = points.mode == mode
            A[chosen] = fam.responses(shape, mode, points.x[chosen], points.across[chosen]).T
        return A * factor[:, None]

    def of_shape(shape: Array) -> tuple[Array, Array]:
        A = system(shape)
        scale = solve_scales(A, b, fam.moduli(shape), positive)
        return scale, A @ scale - b

    # the best of all starts that has a positive shear modulus
    best = None
    if fam.shapes:
        shape_of, starts, bounds = shape_variables(fam, points)
        ends = [
            least_squares(lambda z: of_shape(shape_of(z))[1], z, bounds=bounds, max_nfev=100).x
            for z in starts
        ]
        shapes = [numpy.where(abs(s) < SMALLEST, SMALLEST, s) for s in map(shape_of, ends)]
    else:
        shapes = [numpy.empty(0)]
    for shape in shapes:
        scale, off = of_shape(shape)
        if fam.moduli(shape) @ scale > 0 and (best is None or off @ off < best[0]):
            best = off @ off, scale, shape
    if best is None:
        raise RunError(
            f"{fam.name}: no constants with a positive shear modulus fit these points: are "
            "stresses of stretches above 1 positive, and those below negative? Fewer terms, or "
            "stable ones, may do"
        )
    _, scale, shape = best
    if fam.name == "ogden":
        # terms that bear nothing are left out; the largest share of the modulus first
        order = [k for k in numpy.argsort(-abs(scale)) if scale[k]]
        fam, scale, shape = family("ogden", len(order)), scale[order], shape[order]
    return Fit(Law.of(fam, scale, shape), points)


def fit_law(
    points: Points,
    law: str,
    terms: int | None = None,
    errors: str = "relative",
    stable: bool = False,
    fixed: dict[str, Any] | None = None,
) -> Fit:
    """Fits a law, of so many terms, to Points; terms of holzapfel_gasser_ogden: 2 families of
    fibres at an angle to `fibre` to both sides (the default), or 1 along it.
    fixed: {constant: value} of laws with fibres. Returns a Fit; RunError where there are too few
    points, or no constants have a positive shear modulus."""
    if law in FIBRE_LAWS:
        if terms is not None and (law != "holzapfel_gasser_ogden" or terms not in (1, 2)):
            raise RunError(
                f"{law} with {terms} terms: holzapfel_gasser_ogden has 1 or 2 families of fibres, "
                "other laws with fibres have no choice"
            )
        fibres = FIBRE_LAWS[law]
        nconstant = fibres.nconstant - len(set(fixed or ()) | ({"angles"} if terms == 1 else set()))
        points = away_from_rest(points, law, len(fibres.scales), nconstant, turned=True)
        return fit_fibres(
            points,
            fibres,
            terms or 2,
            numpy.sqrt(points.weight) / error_scales(points, errors),
            fixed or {},
        )
    fam = family(law, terms)
    if fixed:
        raise RunError(
            f"{law}: constants are fixed of laws with fibres only ({', '.join(FIBRE_LAWS)})"
        )
    points = away_from_rest(points, law, len(fam.scales), fam.nconstant, turned=False)
    return fit_scales(points, fam, numpy.sqrt(points.weight) / error_scales(points, errors), stable)
