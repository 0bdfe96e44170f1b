"""Runs of the program: one, a sweep over options, a convergence study."""

import csv
import itertools
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy

from .run import Run, RunError

TOP = Path(__file__).resolve().parents[2]  # of the checkout, or of what make install laid down


def program() -> str:
    """The program: $SB_SUPPLE, that of the checkout, or from PATH."""
    for name in (os.environ.get("SB_SUPPLE"), TOP / "bin" / "supple", shutil.which("supple")):
        if name and Path(name).exists():
            return str(Path(name).resolve())
    raise RunError("there is no program supple: build it (make), or name it by SB_SUPPLE")


def command(ranks: int) -> list[str]:
    """What starts the program on so many ranks, the program included."""
    launcher = TOP / "scripts" / "mpi"
    return (
        [str(launcher), str(ranks)]
        if launcher.exists()
        else ["mpiexec", "-n", str(ranks)]
        if ranks > 1
        else []
    ) + [program()]


def text_of(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return (
        ",".join(map(text_of, value)) if isinstance(value, (tuple, numpy.ndarray)) else str(value)
    )


def scenario_view(scenario: str | Path, folder: str | Path) -> dict[str, str]:
    """{option: value} of all options that a scenario has, as texts, with their defaults."""
    viewed = subprocess.run(
        [program(), str(scenario), "-scenario_view", "-output_dir", str(folder)],
        capture_output=True,
        text=True,
    )
    if viewed.returncode:
        raise RunError(
            viewed.stderr.strip().splitlines()[-1]
            if viewed.stderr.strip()
            else f"{scenario} cannot be read"
        )
    found = {}
    for line in viewed.stdout.splitlines():
        words = line.lstrip("# ").split(None, 1)
        if words and words[0].startswith("-"):
            # a value in quotes may have a mark of remarks in it
            value = words[1] if len(words) > 1 else ""
            quoted = value.startswith('"')
            found[words[0][1:]] = (
                value[1:].partition('"')[0] if quoted else value.partition("#")[0].strip()
            )
    return found


def options_of(scenario: str | Path, options: dict[str, Any], folder: str | Path) -> list[str]:
    """The program's options from keywords: full names (body_organ_young, ts_dt), or the end of
    those of every body (young). folder: of the run, so that runs beside each other do not meet in
    that of the scenario."""
    known = scenario_view(scenario, folder)
    bodies = known["bodies"].split(",") if "bodies" in known else []
    found: list[str] = []
    for name, value in options.items():
        of_bodies = [f"body_{body}_{name}" for body in bodies]
        if (
            name not in known
            and not any(option in known for option in of_bodies)
            and "_" not in name
        ):
            near = get_close_matches(name, [k.rpartition("_")[2] for k in known] + list(known), 1)
            raise RunError(
                f"{scenario} has no option -{name}" + (f"; is {near[0]} meant?" if near else "")
            )
        for option in (
            of_bodies
            if name not in known and any(option in known for option in of_bodies)
            else [name]
        ):
            found += [f"-{option}", text_of(value)]
    return found


def start(scenario: str | Path, folder: str | Path, ranks: int = 1, **options: Any) -> Run:
    """Runs a scenario into `folder` and returns its Run. Keywords are options without the dash;
    one that only bodies have, young=2e4, is given to all of them. Results of an earlier run in
    `folder` are replaced, unless output_overwrite=False keeps them in its subfolder before_DATE.
    Raises RunError with the program's message when the run fails."""
    options = {"output_overwrite": True} | options
    done = subprocess.run(
        [
            *command(ranks),
            str(scenario),
            "-output_dir",
            str(folder),
            "-quiet",
            *options_of(scenario, options, folder),
        ],
        capture_output=True,
        text=True,
    )
    if done.returncode:
        lines = [
            line for line in done.stderr.splitlines() if line.startswith("supple: error:")
        ] or done.stderr.strip().splitlines()
        raise RunError(lines[-1] if lines else f"{scenario}: exit code {done.returncode}")
    return Run(folder)


class Table:
    """Rows of {column: value}: table["young"] is a column as an array, table[2] a row; printed, and
    written as CSV."""

    def __init__(self, rows: Iterable[dict[str, Any]]) -> None:
        self.rows = list(rows)
        self.columns = list(dict.fromkeys(name for row in self.rows for name in row))

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def __getitem__(self, key: str | int) -> Any:
        return (
            numpy.array([row.get(key, math.nan) for row in self.rows])
            if isinstance(key, str)
            else self.rows[key]
        )

    def text(self, columns: Sequence[str] | None = None) -> str:
        show = lambda value: f"{value:.6g}" if isinstance(value, float) else str(value)
        lines = [list(columns or self.columns)] + [
            [show(row.get(name, "")) for name in columns or self.columns] for row in self.rows
        ]
        widths = [max(map(len, column)) for column in zip(*lines)]
        return "\n".join(
            "  ".join(word.rjust(width) for word, width in zip(line, widths)) for line in lines
        )

    def __str__(self) -> str:
        return self.text()

    __repr__ = __str__

    def write_csv(self, path: str | Path) -> None:
        with open(path, "w", newline="") as f:
            writer = csv.DictWriter(f, self.columns)
            writer.writeheader()
            writer.writerows(self.rows)


def bar(done: int, total: int) -> None:
    if sys.stderr.isatty():
        print(
            f"\r[{'#' * (30 * done // total):30}] {done} of {total} runs",
            end="\n" if done == total else "",
            file=sys.stderr,
            flush=True,
        )


def sweep(
    scenario: str | Path,
    folder: str | Path = "out/sweep",
    ranks: int = 1,
    columns: Sequence[str] | None = None,
    progress: bool = True,
    workers: int = 1,
    **options: Any,
) -> Table:
    """Runs a scenario for every combination of the options that are lists, `workers` runs at a
    time, each into folder/0000, ...

    With ranks and workers, ranks * workers processes compute at once. On a terminal a bar counts
    the runs that have ended.

    Returns a Table: the options that vary, `status` (completed, or the reason of a failure), the
    columns of the last row of the history (those named, else all), and `folder`. A run that
    fails does not end the sweep."""
    lists = {name: values for name, values in options.items() if isinstance(values, list)}
    fixed = {name: value for name, value in options.items() if name not in lists}
    cases = list(itertools.product(*lists.values()))
    if workers < 1 or int(workers) != workers:
        raise RunError(f"workers={workers}: how many runs at a time, 1 or more")

    def run_case(k: int) -> dict[str, Any]:
        row = dict(zip(lists, cases[k]))
        place = Path(folder) / f"{k:04d}"
        try:
            run = start(scenario, place, ranks, **fixed, **row)
            last = run.history[-1]
            row |= {"status": run.info["status"]} | {
                name: float(last[name]) for name in columns or run.history.dtype.names or ()
            }
            run.close()
        except RunError as e:
            row["status"] = str(e)
        return row | {"folder": str(place)}

    # threads only wait: each starts a run and reads the end of its history
    if progress:
        bar(0, len(cases))
    with ThreadPoolExecutor(workers) as pool:
        runs = [pool.submit(run_case, k) for k in range(len(cases))]
        try:
            for done, _ in enumerate(as_completed(runs)):
                if progress:
                    bar(done + 1, len(cases))
        finally:
            for run in runs:
                run.cancel()  # those that have not begun, after Ctrl-C
    return Table([run.result() for run in runs])


def richardson(sizes: Iterable[float], values: Iterable[float]) -> tuple[float, float]:
    """Order and limit of f(h) = f0 + C h^p through the three smallest sizes h: (p, f0); (nan, value
    of the smallest) where they do not approach a limit in that way.

    Reference: Roache, Verification and Validation in Computational Science and Engineering, 1998,
    section 5.
    """
    (h1, f1), (h2, f2), (h3, f3) = sorted(zip(map(float, sizes), map(float, values)))[:3]
    if f2 == f1 or (f3 - f2) / (f2 - f1) <= 0:
        return math.nan, f1
    wanted = (f3 - f1) / (f2 - f1)
    ratio = lambda p: math.expm1(p * math.log(h3 / h1)) / math.expm1(p * math.log(h2 / h1))
    low, high = 1e-3, 20.0
    if not ratio(low) < wanted < ratio(high):
        return math.nan, f1
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if ratio(middle) < wanted else (low, middle)
    p = (low + high) / 2
    return p, f1 - (f2 - f1) / math.expm1(p * math.log(h2 / h1))


class Convergence:
    """Of a quantity with the size of the mesh or the step: sizes and values [n], order, limit
    (extrapolated), errors [n] against it; these are nan where no convergence is seen."""

    def __init__(self, quantity: str, sizes: Sequence[float], values: Sequence[float]) -> None:
        self.quantity, self.sizes, self.values = (
            quantity,
            numpy.array(sizes, dtype=float),
            numpy.array(values, dtype=float),
        )
        self.order, self.limit = richardson(sizes, values)
        first, second = self.values[numpy.argsort(self.sizes)[:2]]
        self.same = bool(first == second)
        if not self.converges:
            self.limit = math.nan
        self.errors = numpy.abs(self.values - self.limit)

    @property
    def converges(self) -> bool:
        """Whether the differences between the three smallest sizes become smaller as those of a
        power of the size do, or the last one is zero."""
        return not math.isnan(self.order) or self.same

    def told(self) -> str:
        if self.same:
            return f"the two smallest sizes give the same value, {self.limit:.8g}"
        return (
            f"order {self.order:.3g}, limit {self.limit:.8g}"
            if self.converges
            else "no convergence seen: "
            "the differences of the values do not become smaller with the size"
        )

    def __str__(self) -> str:
        rows = [
            {"size": h, self.quantity: f} | ({"error": e} if self.converges else {})
            for h, f, e in zip(self.sizes, self.values, self.errors)
        ]
        return f"{Table(rows)}\n{self.told()}"


def convergence(
    scenario: str | Path,
    quantity: str | Callable[[Run], float],
    sizes: Sequence[float],
    folder: str | Path = "out/convergence",
    ranks: int = 1,
    progress: bool = True,
    **options: Any,
) -> Convergence:
    """Runs a scenario once for each of `sizes` (m, or s), and extrapolates a quantity to size zero.

    Options that are lists have one value for each size: mesh=["box:1,1,1:4", "box:1,1,1:8"], or
    ts_dt=[0.01, 0.005]. The quantity is a column of the history, whose last row counts, or a
    function of the Run. Three sizes at least. Returns a Convergence."""
    if len(sizes) < 3 or any(len(v) != len(sizes) for v in options.values() if isinstance(v, list)):
        raise RunError(
            "a convergence study needs three sizes or more, and as many values of each option "
            f"that is a list; sizes are {sizes}"
        )
    values = []
    for k in range(len(sizes)):
        if progress:
            bar(k, len(sizes))
        run = start(
            scenario,
            Path(folder) / f"{k:04d}",
            ranks,
            **{name: v[k] if isinstance(v, list) else v for name, v in options.items()},
        )
        values.append(quantity(run) if callable(quantity) else float(run.history[-1][quantity]))
        run.close()
    if progress:
        bar(len(sizes), len(sizes))
    return Convergence(quantity.__name__ if callable(quantity) else quantity, sizes, values)
