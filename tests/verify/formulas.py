"""The evaluator of formulas in python/supple: the cases that the program passes, too; tables; columns in scripts/plot; and that Python sources run no text as code.

@cpu 120
"""
import math
import os
import random
import subprocess
import sys
from pathlib import Path

import numpy

sys.path.insert(0, str(Path("python").resolve()))
from supple.formula import Formula, FormulaError, read_table, split_formulas, value_at
from supple.run import RunError, read_text

OUT = Path(os.environ.get("SB_OUT", "build/test-out/formulas")).resolve()
OUT.mkdir(parents=True, exist_ok=True)
PLACE = {"t": 4.0, "x": 0.5, "y": -2.0, "z": 3.0}


def check(condition, text):
    if not condition:
        sys.exit(text)


def refused(function, *words):
    try:
        function()
    except RunError as e:
        check(all(word in str(e) for word in words), f"'{e}' does not name {words}")
        return
    sys.exit(f"no error that names {words}")


def check_cases():
    values = errors = 0
    for line in Path("tests/data/formulas.txt").read_text().split("\n"):
        if not line or line.startswith("#"):
            continue
        text, expected, *words = line.split("|")
        if expected[0] == "=":
            value, right = float(Formula(text)(PLACE)), float(expected[1:])
            check(value == right or abs(value - right) <= 1e-14 * abs(right) or math.isnan(value) and math.isnan(right), f"'{text}' is {value}, expected {right}")
            # arrays give what numbers give
            array = numpy.broadcast_to(Formula(text)({name: numpy.array([1.0, value]) for name, value in PLACE.items()}), 2)[1]
            check(numpy.array_equal(array, value, equal_nan=True) or abs(array - value) <= 1e-14 * abs(value), f"'{text}' of arrays is {array}")
            values += 1
        else:
            refused(lambda: Formula(text, where="-test"), "-test", f"column {expected[1:]} of", f"'{text}'", *words)
            errors += 1
    check(values > 40 and errors > 30, f"{values} values, {errors} errors")


def check_random():
    """20,000 random texts of the grammar's words and of others: a number, or an error of one line that names a column."""
    words = [*"+-*/^(),.; t x y z pi 1 2. .5e1 0x1 1e400 sin( min( clamp( step( ramp sqrt( __ eval [ ' é \0 ² table: \t".split(" "), " "]
    choose = random.Random(1)
    values = 0
    for _ in range(20000):
        text = "".join(choose.choice(words) for _ in range(choose.randrange(12)))
        try:
            values += isinstance(float(Formula(text)(PLACE)), float)
        except FormulaError as e:
            check("column " in str(e), f"{text!r}: {e}")
    check(values > 100, f"only {values} are formulas")


def check_same(count=int(os.environ.get("SB_MUTATIONS", "4000"))):
    """Random formulas, and some that a few changed letters have damaged: the program gives the same values, and errors at the same columns."""
    program = Path(os.environ.get("SB_BUILD", "build")) / "tests" / "unit" / "test_formula"
    if not program.exists():
        print(f"no {program}: not compared with the program")
        return
    choose = random.Random(2)
    functions = {"sin": 1, "cos": 1, "sqrt": 1, "abs": 1, "exp": 1, "log": 1, "floor": 1, "tanh": 1, "min": 2, "max": 2, "atan2": 2, "step": 1, "ramp": 1, "clamp": 3}

    def expression(depth):
        way = choose.randrange(9) if depth else choose.randrange(2)
        if way == 0:
            return choose.choice("txyz") if choose.randrange(4) else "pi"
        if way == 1:
            return choose.choice(("0", "1", "2.5", ".5", "1e-3", "3.", "0x1F", "1e400", "7e-320"))
        if way == 2:
            return choose.choice("+-") + expression(depth - 1)
        if way == 3:
            name = choose.choice(list(functions))
            return f"{name}({','.join(expression(depth - 1) for _ in range(functions[name]))})"
        if way == 4:
            return f"({expression(depth - 1)})"
        return expression(depth - 1) + choose.choice(("+", "-", " * ", "/", "^", "**")) + expression(depth - 1)

    texts = []
    for i in range(count):
        text = expression(choose.randrange(1, 6))
        for _ in range(choose.randrange(3) if i % 2 else 0):
            at = choose.randrange(len(text) + 1)
            text = text[:at] + choose.choice((*"()+-*/^,.;txe10 _$", "", "sin", "\t")) + text[at + choose.randrange(3):]
        texts.append(text)
    (OUT / "formulas.txt").write_text("".join(text + "\n" for text in texts))
    done = subprocess.run([program, "-formulas", OUT / "formulas.txt"], capture_output=True, text=True)
    told = done.stdout.splitlines()
    check(done.returncode == 0 and len(told) == count, f"{len(told)} answers for {count} formulas: {done.stderr[-300:]}")
    errors = 0
    for text, theirs in zip(texts, told):
        try:
            mine = float(Formula(text)(PLACE))
        except FormulaError as e:
            column = str(e).split("column ")[1].split()[0].rstrip(":,")
            check(theirs == f"!{column}", f"'{text}': here an error at column {column}, in the program {theirs}")
            errors += 1
            continue
        check(not theirs.startswith("!"), f"'{text}' is {mine}, in the program an error at column {theirs[1:]}")
        right = float(theirs)
        near = mine == right or math.isnan(mine) and math.isnan(right) or abs(mine - right) <= 1e-9 * max(abs(mine), abs(right), 1e-300)
        check(near, f"'{text}' is {mine}, in the program {right}")
    check(errors > count / 10, f"only {errors} errors")


def check_tables():
    path = OUT / "table.txt"
    path.write_text("# t value\n0 1\n\n 1, 3 # here\r\n2\t5\n4;-5")
    times, values = read_table(path)
    check(list(times) == [0, 1, 2, 4] and list(values) == [1, 3, 5, -5], "a table")
    check([value_at(f"table:{path}", t) for t in (-1, 0.25, 3, 9)] == [1, 1.5, 0, -5], "between its rows, and outside")
    for text, word in (("0 1\n1 x\n", "line 2"), ("0 1\n1\n", "line 2"), ("0 1 2\n", "line 1"), ("0 nan\n", "line 1"), ("0 1_0\n", "line 1"),
                       ("0 1\n2 1\n2 3\n", "line 3"), ("# nothing\n", "table.txt")):
        path.write_text(text)
        refused(lambda: read_table(path, "-test"), "-test", "table.txt", word)
    refused(lambda: value_at("table:/nonexistent.txt", 0), "/nonexistent.txt")
    check(split_formulas("min(t,1), 2,3") == ["min(t,1)", "2", "3"] and split_formulas("a;b,c") == ["a", "b,c"], "several formulas")

    # what never ends, or would wait for ever
    os.mkfifo(OUT / "pipe")
    for name in (OUT / "pipe", "/dev/zero"):
        refused(lambda: read_table(name), str(name), "regular")
    path.write_text("1" * 100)
    try:
        read_text(path, 99)
        sys.exit("a text that is too long was read")
    except OSError as e:
        check("99" in str(e), f"{e}")


def check_plot():
    """A formula of columns that is a command of Python is none."""
    folder = OUT / "run"
    folder.mkdir()
    (folder / "run.json").write_text("{}")
    (folder / "history.csv").write_text("step,time,a,b\n#1,s,J,J\n0,0,1,2\n1,1,3,5\n")
    plot = [sys.executable, "scripts/plot", str(folder), "-o", str(OUT / "plot.svg"), "-y"]
    for text in ("a + b", "cumsum(a) / max(b, 1)", "a^2"):
        done = subprocess.run([*plot, text], capture_output=True, text=True)
        check(done.returncode == 0, f"{text}: {done.stderr}")
    for text in ("a.tofile('%s')" % (OUT / "hacked"), "__import__('os')", "a if a else b", "a.dtype"):
        done = subprocess.run([*plot, text], capture_output=True, text=True)
        check(done.returncode == 1 and "column" in done.stderr and "Traceback" not in done.stderr, f"{text}: {done.stdout}{done.stderr}")
    check(not (OUT / "hacked").exists(), "a formula wrote a file")


def check_sources():
    """scripts/check-python, which make lint calls: nothing in the sources, and each of these is found."""
    def told(*files):
        return subprocess.run([sys.executable, "scripts/check-python", *map(str, files)], capture_output=True, text=True)

    done = told()
    check(done.returncode == 0, done.stdout)
    for text in ("eval('1')", "exec('1')", "__import__('os')", "import pickle", "from pickle import loads", "import os\nos.system('ls')", "run(x, shell=True)",
                 "numpy.load(f, allow_pickle=True)", "f = eval", "compile('1', '', 'eval')", "def f(:"):
        (OUT / "wrong.py").write_text(text + "\n")
        done = told(OUT / "wrong.py")
        check(done.returncode == 1 and "wrong.py:" in done.stdout, f"{text}: {done.stdout}{done.stderr}")
    (OUT / "right.py").write_text("import re\nre.compile('1')\nrun(x, shell=False)\nit.evaluate()\n")
    check(told(OUT / "right.py").returncode == 0, "right.py is refused")
    check("scripts/check-python" in Path("scripts/lint").read_text(), "scripts/lint does not call scripts/check-python")


if __name__ == "__main__":
    check_cases()
    check_random()
    check_same()
    check_tables()
    check_plot()
    check_sources()
