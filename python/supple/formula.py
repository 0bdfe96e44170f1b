"""Formulas of a scenario: supple's own grammar, as in src/base/formula.c and formula_table.c,
evaluated without running any of the text as code.

    expression = term { (+|-) term }
    term       = unary { (*|/) unary }
    unary      = (+|-) unary | power
    power      = primary [ ^ unary ]
    primary    = number | variable | function ( expression {, expression} ) | ( expression )

The two evaluators have the same functions, values and errors: tests/data/formulas.txt is a table of
cases that both pass.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

import numpy

from .run import RunError, read_text

Value = Any  # a number, or an array of them
Function = Callable[..., Value]
STACK = 64  # largest depth of the stack, SB_FORMULA_STACK
BLANKS = " \t\n\v\f\r"
NUMBER = re.compile(
    r"0[xX](?:[0-9a-fA-F]+\.?[0-9a-fA-F]*|\.[0-9a-fA-F]+)(?:[pP][+-]?[0-9]+)?|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
)
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def keeping_nan(function: Function) -> Function:
    """The function with nan wherever an argument is nan: numpy's fmin, power and comparisons would
    lose it."""

    def value(*arguments: Value) -> Value:
        return numpy.where(
            sum(numpy.isnan(a) for a in arguments) > 0, numpy.nan, function(*arguments)
        )

    return value


def clamp(a: Value, low: Value, high: Value) -> Value:
    return numpy.where(a < low, low, numpy.where(a > high, high, a))


# name: number of arguments, function of numbers or arrays
FUNCTIONS: dict[str, tuple[int, Function]] = {
    "sin": (1, numpy.sin),
    "cos": (1, numpy.cos),
    "tan": (1, numpy.tan),
    "asin": (1, numpy.arcsin),
    "acos": (1, numpy.arccos),
    "atan": (1, numpy.arctan),
    "atan2": (2, numpy.arctan2),
    "exp": (1, numpy.exp),
    "log": (1, numpy.log),
    "sqrt": (1, numpy.sqrt),
    "abs": (1, numpy.abs),
    "min": (2, numpy.minimum),
    "max": (2, numpy.maximum),
    "floor": (1, numpy.floor),
    "tanh": (1, numpy.tanh),
    "step": (1, keeping_nan(lambda a: numpy.where(a < 0, 0.0, 1.0))),
    "ramp": (1, lambda a: clamp(a, 0.0, 1.0)),
    "clamp": (3, keeping_nan(clamp)),
}
OPERATORS: dict[str, Function] = {
    "+": numpy.add,
    "-": numpy.subtract,
    "*": numpy.multiply,
    "/": numpy.divide,
    "^": keeping_nan(numpy.power),
}


class FormulaError(RunError):
    """A formula or table that cannot be read; the message says what is wrong and where."""


class Formula:
    """Postfix code of a formula: __call__(variables) gives its value, numbers or arrays as the
    variables are.

    variables: their names. functions: name -> (number of arguments, function), those of scenarios
    without it.
    """

    def __init__(
        self,
        text: str,
        variables: Sequence[str] = ("t", "x", "y", "z"),
        where: str = "formula",
        functions: Mapping[str, tuple[int, Function]] = FUNCTIONS,
    ) -> None:
        self.text, self.where, self.variables, self.functions = text, where, variables, functions
        self.steps: list[tuple[int, Any, Value]] = []
        self.at, self.nesting, self.depth = 0, 0, 0
        self.expression("+-")
        if self.at < len(text):
            self.complain(self.at, "expected an operator")

    def complain(self, at: int, what: str) -> NoReturn:
        raise FormulaError(f"{self.where}: column {at + 1} of '{self.text}': {what}")

    def next(self) -> str:
        """The next character that is no blank, "" at the end."""
        while self.text[self.at : self.at + 1] and self.text[self.at] in BLANKS:
            self.at += 1
        return self.text[self.at : self.at + 1]

    def expect(self, c: str) -> None:
        if self.next() != c:
            self.complain(self.at, f"expected '{c}'")
        self.at += 1

    def emit(self, number: int, function: Any, value: Value = None) -> None:
        """One instruction: takes `number` values from the stack, and puts one there."""
        self.steps.append((number, function, value))
        self.depth += 1 - number
        if self.depth > STACK:
            self.complain(self.at, "the formula is nested too deeply")

    def expression(self, operators: str) -> None:
        """Operands joined by the operators of one rank."""
        operator = None
        while True:
            self.expression("*/") if operators == "+-" else self.unary()
            if operator:
                self.emit(2, OPERATORS[operator])
            operator = self.next()
            if not operator or operator not in operators:
                return
            self.at += 1

    def unary(self) -> None:
        self.nesting += 1
        if self.nesting > 4 * STACK:
            self.complain(self.at, "the formula is nested too deeply")
        c = self.next()
        if c and c in "+-":
            self.at += 1
            self.unary()
            if c == "-":
                self.emit(1, numpy.negative)
        else:
            number, name = NUMBER.match(self.text, self.at), NAME.match(self.text, self.at)
            if number:
                self.at = number.end()
                self.emit(0, None, numpy.float64(number_of(number[0])))
            elif name:
                self.word(name)
            elif c == "(":
                self.at += 1
                self.expression("+-")
                self.expect(")")
            else:
                self.complain(
                    self.at,
                    "expected a number, a name or '('" if c else "the formula ends too early",
                )
            if self.next() == "^":
                self.at += 1
                self.unary()
                self.emit(2, OPERATORS["^"])
        self.nesting -= 1

    def word(self, found: re.Match[str]) -> None:
        name, self.at = found[0], found.end()
        if name == "pi":
            self.emit(0, None, numpy.float64(numpy.pi))
        elif name in self.variables:
            self.emit(0, name)
        elif name in self.functions:
            number, function = self.functions[name]
            for k in range(number):
                self.expect("," if k else "(")
                self.expression("+-")
            self.expect(")")
            self.emit(number, function)
        else:
            near = (
                get_close_matches(name, [*self.functions, *self.variables, "pi"], 1)
                if len(name) > 1
                else []
            )
            advice = (
                f"did you mean {near[0]}?"
                if near
                else f"a formula knows {', '.join(self.variables)}, pi "
                "and functions such as sin, sqrt, ramp"
            )
            self.complain(found.start(), f"unknown name '{name}'; {advice}")

    def __call__(self, variables: Mapping[str, Value]) -> Value:
        stack: list[Value] = []
        with numpy.errstate(all="ignore"):
            for number, function, value in self.steps:
                if number == 0:
                    stack.append(
                        value
                        if function is None
                        else numpy.asarray(variables[function], dtype=float)[()]
                    )
                else:
                    stack[-number:] = [function(*stack[-number:])]
        return stack[0]


def number_of(word: str) -> float:
    """A number as C reads it, with its sign; nan where the word is none."""
    if not NUMBER.fullmatch(word[word[:1] in ("+", "-") :]):
        return numpy.nan
    try:
        return float.fromhex(word) if "x" in word.lower() else float(word)
    except OverflowError:  # C's strtod() gives infinity, too
        return -numpy.inf if word[0] == "-" else numpy.inf


def read_table(path: str | Path, where: str = "table") -> numpy.ndarray:
    """Times (s, ascending) and values of a table in a file: two arrays [n]."""
    rows: list[list[float]] = []
    try:
        lines = read_text(path).split("\n")
    except OSError as e:
        raise FormulaError(f"{where}: cannot open {path}: {e.strerror or e}") from None
    for number, line in enumerate(lines, 1):
        text = line.split("#")[0].strip(BLANKS)
        if not text:
            continue
        row = [number_of(word) for word in re.split(rf"[{BLANKS},;]+", text)]
        if len(row) != 2 or not numpy.isfinite(row).all():
            raise FormulaError(
                f"{where}: {path}, line {number}: expected two numbers, time (s) and value"
            )
        if rows and row[0] <= rows[-1][0]:
            raise FormulaError(
                f"{where}: {path}, line {number}: time {row[0]:g} s does not come after "
                f"{rows[-1][0]:g} s; times must ascend"
            )
        rows.append(row)
    if not rows:
        raise FormulaError(f"{where}: {path} holds no numbers")
    return numpy.array(rows).T


def split_formulas(text: str) -> list[str]:
    """The formulas of an option: semicolons between them, or commas outside parentheses."""
    if ";" not in text:
        depth = 0
        pieces = [""]
        for c in text:
            depth += (c == "(") - (c == ")")
            if c == "," and depth == 0:
                pieces.append("")
            else:
                pieces[-1] += c
    else:
        pieces = text.split(";")
    return [piece.strip(BLANKS) for piece in pieces]


def value_at(text: str, t: float, where: str = "formula") -> float:
    """Value of one of the scenario's formulas of time (s), or of the table that it names."""
    text = text.strip(BLANKS)
    if text.startswith("table:"):
        return float(numpy.interp(t, *read_table(Path(text[6:]), where)))
    return float(Formula(text, where=where)({"t": t, "x": 0.0, "y": 0.0, "z": 0.0}))
