"""Options of a scenario from what was measured on it: least squares over runs.

A trust region (scipy's) in the logarithms of the unknowns, whose derivatives are forward
differences between runs. Not handled: runs whose history jumps with an
unknown, by contact that opens or steps that change; minima that are not the nearest one.
"""

import csv
import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy
from numpy.typing import ArrayLike

from .run import Run, RunError
from .study import Table, start

Array = numpy.ndarray
Curve = str | Path | tuple[ArrayLike, ArrayLike]  # a CSV file of two columns, or x and y

# of the differences between runs, relative: far above what the tolerances of a run leave, and a
# small part of the curvature of usual curves
STEP = 0.01
ALIKE = 0.999  # correlation of two unknowns from which on a test does not tell them apart


def read_curve(curve: Curve, column: str) -> tuple[Array, Array]:
    """(x [n], y [n]) of a pair of lists, or of a CSV file of two columns, whose lines without
    numbers are left out."""
    if not isinstance(curve, (str, Path)):
        x, y = (numpy.asarray(values, dtype=float) for values in curve)
    else:
        rows = []
        try:
            lines = Path(curve).read_text().splitlines()
        except OSError as e:
            raise RunError(f"{curve} cannot be read: {e.strerror}") from None
        for words in csv.reader(line.partition("#")[0] for line in lines):
            try:
                rows.append([float(word) for word in words[:2]])
            except ValueError:
                continue
        rows = [row for row in rows if len(row) == 2]
        x, y = numpy.array(rows).reshape(-1, 2).T
    if (
        x.shape != y.shape
        or x.ndim != 1
        or not len(x)
        or not numpy.isfinite([x, y]).all()
        or not y.any()
    ):
        raise RunError(
            f"what was measured for {column} is two columns of numbers of one length, not all "
            f"zero; there are {x.size} and {y.size}"
        )
    return x, y


def names_of(values: Mapping[str, Any]) -> list[str]:
    """Of options, with a number behind those of a list."""
    return [
        name if numpy.isscalar(value) else f"{name}[{k}]"
        for name, value in values.items()
        for k in range(numpy.size(value))
    ]


class Identified:
    """Options that were found.

    values       - {option: value}; of a list {option: [values]}
    deviations   - likewise their standard deviations, from the scatter of the measured points about
                   the curves; nan without points to spare
    misfits      - {column: root mean square of the differences over that of what was measured}
    correlation  - [n][n] of all values, in the order of `names`
    names        - of all values: option, or option[0], option[1], ... of a list
    nrun         - runs that it took
    run          - Run of the values
    """

    def __init__(
        self,
        values: dict[str, Any],
        deviations: dict[str, Any],
        misfits: dict[str, float],
        correlation: Array,
        nrun: int,
        run: Run,
    ) -> None:
        self.values, self.deviations, self.misfits, self.correlation, self.nrun, self.run = (
            values,
            deviations,
            misfits,
            correlation,
            nrun,
            run,
        )
        self.names = names_of(values)

    @property
    def alike(self) -> list[tuple[str, str]]:
        """Pairs of options that the measurements do not tell apart."""
        names = self.names
        return [
            (names[i], names[j])
            for i in range(len(names))
            for j in range(i)
            if not abs(self.correlation[i, j]) < ALIKE
        ]

    def __str__(self) -> str:
        flat = zip(
            self.names,
            numpy.hstack(list(self.values.values())),
            numpy.hstack(list(self.deviations.values())),
        )
        rows = [
            {"option": name, "value": f"{value:.6g}", "deviation": f"{deviation:.2g}"}
            for name, value, deviation in flat
        ]
        lines = [
            str(Table(rows)),
            *(f"{column}: {100 * misfit:.2g} % off" for column, misfit in self.misfits.items()),
            f"{self.nrun} runs",
        ]
        return "\n".join(
            lines + [f"{a} and {b} are not told apart by these measurements" for a, b in self.alike]
        )

    __repr__ = __str__


def fit(
    scenario: str | Path,
    measured: Mapping[str, Curve],
    unknown: Mapping[str, Any],
    folder: str | Path = "out/fit",
    over: str = "time",
    bounds: Mapping[str, tuple[float, float]] | None = None,
    workers: int = 1,
    ranks: int = 1,
    **options: Any,
) -> Identified:
    """Finds the values of options with which runs of a scenario come closest to what was measured.
    Needs scipy.

    measured   - {column of history.csv: (x, y), or a CSV file of two columns}: forces, probes;
                 values at x of the column `over`
    unknown    - {option: value to start from}, not 0: names as those of start(). A value keeps its
                 sign. A list is an option that is one: {"mu": [1e5, -1e4], "alpha": [2, -2]}
    folder     - of the runs, in its subfolders 0000, ..., which are overwritten; 0000 has the
                 values that were found
    over       - column of x: time (s; the load factor of a static run), or another one that rises
                 or falls throughout
    bounds     - {option: (low, high)}, of a list for all that is in it, or {"mu[0]": (low, high)}
                 for one value of it
    workers    - runs at a time; more than the number of unknowns do not help. ranks - of each
    options    - of all runs, as those of start(); fields are written only where output_fields is
                 given

    Minimised are the squares of the differences, over the mean square of the measured values of
    their column, by a trust region with
    differences between runs as derivatives. Returns an Identified; RunError where the first runs
    fail, or do not reach all x.
    """
    from scipy.optimize import least_squares

    flat = [
        v
        for value in unknown.values()
        for v in (value if isinstance(value, (list, tuple, numpy.ndarray)) else [value])
    ]
    if not flat or any(
        isinstance(v, (bool, str)) or not numpy.isscalar(v) or not numpy.isfinite(v) or v == 0
        for v in flat
    ):
        raise RunError(
            "unknown options are numbers to start from, or lists of them, not 0; they are "
            f"{unknown}"
        )
    names = names_of(unknown)
    curves = {column: read_curve(curve, column) for column, curve in measured.items()}
    npoint = sum(len(x) for x, _ in curves.values())
    if npoint < len(flat):
        raise RunError(
            f"{len(flat)} unknown options need as many measured points or more; there are {npoint}"
        )
    first = numpy.array(flat, dtype=float)
    low, high = numpy.full(len(first), -numpy.inf), numpy.full(len(first), numpy.inf)
    for name, pair in (bounds or {}).items():
        # of one value, or of all of a list
        chosen = [k for k, own in enumerate(names) if own == name or own.partition("[")[0] == name]
        if not chosen:
            raise RunError(
                f"bounds of {name}, which is not among the unknown options {', '.join(names)}"
            )
        for k in chosen:
            if not min(pair) < first[k] < max(pair):
                raise RunError(
                    f"{names[k]} starts at {first[k]:g}, which is not within its bounds "
                    f"{min(pair):g} to {max(pair):g}"
                )
            ends = [math.log(end / first[k]) if end / first[k] > 0 else -math.inf for end in pair]
            low[k], high[k] = min(ends), max(ends)

    def folded(flat: Array) -> dict[str, Any]:
        """{option: value or list} of all values."""
        found, k = {}, 0
        for name, value in unknown.items():
            n = numpy.size(value)
            found[name] = (
                float(flat[k]) if numpy.isscalar(value) else numpy.asarray(flat[k : k + n]).tolist()
            )
            k += n
        return found

    # lists as options have them
    values_of = lambda u: {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in folded(first * numpy.exp(u)).items()
    }
    known, count = {}, 0

    def differences(u: Array, number: int = 0) -> Array:
        """Of a run with the values first * exp(u) [npoint]."""
        run = start(
            scenario,
            Path(folder) / f"{number:04d}",
            ranks,
            **({"output_fields": "none"} | options),
            **values_of(u),
        )
        parts = []
        table = run.history
        columns = table.dtype.names or ()
        for column, (x, y) in curves.items():
            missing = [name for name in (over, column) if name not in columns]
            if missing:
                raise RunError(
                    f"the history has no column {missing[0]}; it has {', '.join(columns)}"
                )
            place = table[over]
            order = slice(None, None, -1 if place[-1] < place[0] else 1)
            if (numpy.diff(place[order]) <= 0).any():
                raise RunError(
                    f"{over} neither rises nor falls throughout the run: it cannot be the x of "
                    f"{column}"
                )
            slack = 1e-9 * (place.max() - place.min())
            if x.min() < place.min() - slack or x.max() > place.max() + slack:
                raise RunError(
                    f"{column} was measured from {over} {x.min():g} to {x.max():g}; the run has "
                    f"{place.min():g} to {place.max():g}"
                )
            parts.append(
                (numpy.interp(x, place[order], table[column][order]) - y)
                / math.sqrt((y**2).mean() * len(y))
            )
        run.close()
        return numpy.concatenate(parts)

    def at(u: Array) -> Array:
        nonlocal count
        key = tuple(u)
        if key not in known:
            count += 1
            try:
                known[key] = differences(u)
            except RunError:
                if len(known) == 0:
                    raise
                known[key] = numpy.full(
                    npoint, numpy.nan
                )  # too far: the trust region becomes smaller
        return known[key]

    def slopes(u: Array) -> Array:
        nonlocal count
        here = at(u)
        steps = [
            numpy.where(numpy.arange(len(u)) == k, STEP if u[k] + STEP < high[k] else -STEP, 0.0)
            for k in range(len(u))
        ]
        count += len(u)
        # threads only wait, each for its run
        with ThreadPoolExecutor(workers) as pool:
            beside = list(pool.map(differences, [u + s for s in steps], range(1, len(u) + 1)))
        J = numpy.array([(r - here) / s.sum() for r, s in zip(beside, steps)]).T
        for name, column in zip(names, J.T):
            if not column.any():
                raise RunError(f"{name} changes nothing of what was measured")
        return J

    found = least_squares(
        at,
        numpy.zeros(len(first)),
        slopes,
        bounds=(low, high),
        method="trf",
        xtol=1e-5,
        ftol=1e-8,
        gtol=1e-10,
    )
    run = start(
        scenario,
        Path(folder) / "0000",
        ranks,
        **({"output_fields": "none"} | options),
        **values_of(found.x),
    )
    # standard deviations and correlations of ln(value)
    spare = npoint - len(first)
    _, singular, V = numpy.linalg.svd(found.jac, full_matrices=False)
    weak = V.T / numpy.maximum(singular, 1e-12 * singular[0])
    covariance = weak @ weak.T
    size = numpy.sqrt(numpy.diag(covariance))
    scatter = math.sqrt(2 * found.cost / spare) if spare else math.nan
    misfits, k = {}, 0
    for column, (x, _) in curves.items():
        misfits[column] = float(numpy.linalg.norm(found.fun[k : k + len(x)]))
        k += len(x)
    values = first * numpy.exp(found.x)
    return Identified(
        folded(values),
        folded(abs(values) * size * scatter),
        misfits,
        covariance / numpy.outer(size, size),
        count + 1,
        run,
    )
