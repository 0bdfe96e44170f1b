"""Laws of rubber and tissue in closed form: the stress of incompressible bodies in tests of
materials, as the program's laws have it.

    law = Law("ogden", mu=[0.63e6, 0.0012e6, -0.01e6], alpha=[1.3, 5, -2])
    law.nominal_stress("uniaxial", [1.5, 2, 3])           Pa, force over the area at rest
    law.shear_modulus, law.stable("planar", 0.3, 3), law.option_lines("band")

A mode has the logarithms e_k of the principal stretches, of sum 0, and the Kirchhoff stresses
t_k = dW/de_k, up to a pressure. With the third side free of load the nominal stress is
(t_1 - t_3)/s_1, and in simple shear by g, whose stretches are l, 1 and 1/l, g = l - 1/l, it is
(t_1 - t_3)/(l + 1/l).

    laws of I1 and I2   t_k = 2 W1 s_k^2 - 2 W2/s_k^2,   W1 = dW/dI1, W2 = dW/dI2
    ogden               t_k = sum_i mu_i s_k^alpha_i

Reference: Ogden, Non-linear elastic deformations, 1984, chapter 7. The energies are those of
docs/reference/materials.md; tests/verify/fit.py runs the program beside.
What is not here: laws with fibres (fibres.py), and those of small strains or without a limit of
constant volume.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from typing import Any

import numpy
from numpy.typing import ArrayLike

from .run import RunError

Array = numpy.ndarray
Pairs = list[tuple[Any, Any]]  # W1 and W2 for each constant, numbers or arrays [n]
Slopes = Callable[[Array, Any, Any], Pairs]  # of the shape, I1 - 3 and I2 - 3
Columns = Callable[[Array, Array], Array]
Moduli = Callable[[Array], Array]

# mode: what its coordinate is, and the value of that at rest
MODES = {
    "uniaxial": ("stretch", 1.0),
    "compression": ("stretch", 1.0),
    "equibiaxial": ("stretch", 1.0),
    "planar": ("stretch", 1.0),
    "biaxial": ("stretch", 1.0),
    "shear": ("amount of shear", 0.0),
} | {f"shear_{plane}": ("amount of shear", 0.0) for plane in ("fs", "fn", "sf", "sn", "nf", "ns")}
POWERS = {
    "c10": (1, 0),
    "c01": (0, 1),
    "c20": (2, 0),
    "c11": (1, 1),
    "c02": (0, 2),
    "c30": (3, 0),
    "c21": (2, 1),
    "c12": (1, 2),
    "c03": (0, 3),
}
POLYNOMIALS = {
    1: ("c10",),
    2: ("c10", "c01"),
    3: ("c10", "c01", "c11"),
    5: tuple(POWERS)[:5],
    9: tuple(POWERS),
}
LANGEVIN = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)
TERMS = 20  # of ogden, at most
STEPS = 200  # from rest to the end of a range, as the program looks for instability
# eigenvalue, in shear moduli, below which a law is unstable: src/material/stability.c
LOWEST = -1e-5


class LawError(RunError):
    """A law, a constant or a mode that does not exist, or is out of range."""


def strains(mode: str, x: ArrayLike, across: ArrayLike | None = None) -> tuple[Array, Array]:
    """Logarithms of the principal stretches [3, n], and what to divide t_1 - t_3 by for the nominal
    stress. across [n]: the other stretch of a biaxial test."""
    x = numpy.asarray(x, dtype=float)
    if mode.startswith("shear"):
        e = numpy.arcsinh(x / 2)
        return numpy.array([e, 0 * e, -e]), 2 * numpy.cosh(e)
    e = numpy.log(x)
    if mode in ("uniaxial", "compression"):
        return numpy.array([e, -e / 2, -e / 2]), x
    if mode == "equibiaxial":
        return numpy.array([e, e, -2 * e]), x
    if mode == "planar":
        return numpy.array([e, 0 * e, -e]), x
    if mode == "biaxial":
        if across is None or numpy.shape(across) != x.shape:
            raise LawError("biaxial tests need the stretch across for each point")
        a = numpy.log(across)
        return numpy.array([e, a, -e - a]), x
    raise LawError(no_such("mode", mode, MODES))


def no_such(what: str, name: object, known: Iterable[str]) -> str:
    near = get_close_matches(str(name), list(known), 1)
    return (
        f"there is no {what} {name}"
        + (f"; is {near[0]} meant?" if near else "")
        + f" ({what}s: {', '.join(known)})"
    )


def text_of(value: float | list[float], digits: int) -> str:
    """A constant, or a list of them, as options have it."""
    return (
        ",".join(f"{v:.{digits}g}" for v in value)
        if isinstance(value, list)
        else f"{value:.{digits}g}"
    )


def around_rest(
    mode: str, low: float, high: float, holds: Callable[[Array], Array], steps: int = STEPS
) -> tuple[float, float]:
    """(from, to): the range around rest, within low and high, in which holds(x [n]) is true
    throughout."""
    rest = MODES[mode][1]
    ends = []
    for end in (low, high):
        x = (
            numpy.linspace(rest, end, steps + 1)
            if rest == 0
            else numpy.geomspace(rest, end, steps + 1)
        )
        with numpy.errstate(all="ignore"):
            good = holds(x) if end != rest else numpy.ones(1, dtype=bool)
        ends.append(float(x[-1] if good.all() else x[max(int(numpy.argmin(good)) - 1, 0)]))
    return ends[0], ends[1]


def of_invariants(slopes: Slopes) -> tuple[Columns, Moduli]:
    """columns() and moduli() of a law from slopes(shape, x1, x2): pairs of W1 and W2 for each
    constant at 1, the others at 0."""

    def columns(shape: Array, e: Array) -> Array:
        up, down = numpy.expm1(2 * e), numpy.expm1(-2 * e)
        return numpy.array(
            [
                2 * W1 * up - 2 * W2 * down
                for W1, W2 in slopes(shape, up.sum(axis=0), down.sum(axis=0))
            ]
        )

    def moduli(shape: Array) -> Array:
        return numpy.array(
            [2 * float(W1 + W2) for W1, W2 in slopes(shape, numpy.float64(0), numpy.float64(0))]
        )

    return columns, moduli


def slopes_mooney(names: Sequence[str]) -> Slopes:
    slope = lambda x, n: n * x ** max(n - 1, 0)
    return lambda shape, x, y: [
        (slope(x, p) * y**q, x**p * slope(y, q)) for p, q in (POWERS[name] for name in names)
    ]


def slopes_gent(shape: Array, x: Any, y: Any) -> Pairs:
    with numpy.errstate(divide="ignore"):
        return [(numpy.where(x < shape[0], 0.5 / (1 - x / shape[0]), numpy.nan), 0)]


def slopes_arruda(shape: Array, x: Any, y: Any) -> Pairs:
    return [
        (sum(i * c * ((x + 3) / shape[0] ** 2) ** (i - 1) for i, c in enumerate(LANGEVIN, 1)), 0)
    ]


def columns_ogden(shape: Array, e: Array) -> Array:
    """Of the moduli mu alpha/2 of the terms; alpha = 0 is the limit, a law of the logarithms."""
    return numpy.array([2 * (numpy.expm1(a * e) / a if a else e) for a in shape])


class Family:
    """A law without its constants.

    name      - as -body_<name>_material has it
    scales    - names of the constants that the stress is proportional to
    shapes    - names of the others
    columns   - columns(shape, e [3, n]) [nscale, 3, n]: t_k for each scale at 1, the others at 0
    moduli    - moduli(shape) [nscale]: the shear modulus at rest for each scale at 1
    """

    def __init__(
        self,
        name: str,
        scales: Sequence[str],
        shapes: Sequence[str],
        functions: tuple[Columns, Moduli],
    ) -> None:
        self.name, self.scales, self.shapes = name, scales, shapes
        self.columns, self.moduli = functions

    def responses(
        self, shape: Array, mode: str, x: ArrayLike, across: ArrayLike | None = None
    ) -> Array:
        """Nominal stresses for each scale at 1 [nscale, n]."""
        e, divisor = strains(mode, x, across)
        t = self.columns(shape, e)
        return (t[:, 0] - t[:, 2]) / divisor

    @property
    def nconstant(self) -> int:
        return len(self.scales) + len(self.shapes)


def family(name: str, terms: int | None = None) -> Family:
    """The Family of a law; terms: of mooney_rivlin 1, 2, 3, 5 or 9, of yeoh 1 to 3, of ogden 1 to
    20."""
    allowed = {
        "mooney_rivlin": tuple(POLYNOMIALS),
        "yeoh": (1, 2, 3),
        "ogden": tuple(range(1, TERMS + 1)),
    }
    if name not in LAWS:
        raise LawError(no_such("law", name, LAWS) + "; laws of small strains are not fitted")
    if name not in allowed:
        if terms not in (None, 1):
            raise LawError(f"{name} has one term, not {terms}")
    elif terms is not None and terms not in allowed[name]:
        raise LawError(f"{name} with {terms} terms: it has {', '.join(map(str, allowed[name]))}")
    if name in ("neohookean", "isochoric_neohookean"):
        return Family(name, ("shear",), (), of_invariants(lambda shape, x, y: [(0.5 + 0 * x, 0)]))
    if name == "stable_neohookean":
        return Family(
            name,
            ("shear",),
            (),
            of_invariants(lambda shape, x, y: [(2 / 3 * (1 - 1 / (x + 4)), 0)]),
        )
    if name == "mooney_rivlin":
        names = POLYNOMIALS[terms or 2]
        return Family(name, names, (), of_invariants(slopes_mooney(names)))
    if name == "yeoh":
        names = ("c1", "c2", "c3")[: terms or 3]
        return Family(
            name,
            names,
            (),
            of_invariants(
                lambda shape, x, y: [(k * x ** (k - 1), 0) for k in range(1, len(names) + 1)]
            ),
        )
    if name == "gent":
        return Family(name, ("mu",), ("jm",), of_invariants(slopes_gent))
    if name == "arruda_boyce":
        return Family(name, ("mu",), ("lambda_m",), of_invariants(slopes_arruda))
    return Family(
        name,
        ("modulus",) * (terms or 1),
        ("alpha",) * (terms or 1),
        (columns_ogden, lambda shape: numpy.ones(len(shape))),
    )


LAWS = (
    "isochoric_neohookean",
    "neohookean",
    "stable_neohookean",
    "mooney_rivlin",
    "yeoh",
    "ogden",
    "gent",
    "arruda_boyce",
)


class Law:
    """A law with its constants, named as the program's options: Law("gent", mu=4e5, jm=70).
    neo-Hookean ones take mu, the shear modulus."""

    def __init__(self, name: str, **constants: Any) -> None:
        if name == "ogden":
            mu, alpha = (
                numpy.atleast_1d(numpy.asarray(constants.pop(key, ()), dtype=float))
                for key in ("mu", "alpha")
            )
            if not len(mu) or len(mu) != len(alpha) or not alpha.all():
                raise LawError("ogden needs mu and alpha, lists of equal length, no alpha 0")
            self.family, self.scale, self.shape = family(name, len(mu)), mu * alpha / 2, alpha
        else:
            self.family = family(name, {"mooney_rivlin": 9}.get(name))
            values = lambda names: numpy.array(
                [float(constants.pop("mu" if key == "shear" else key, 0.0)) for key in names]
            )
            self.scale, self.shape = values(self.family.scales), values(self.family.shapes)
        if constants:
            raise LawError(f"{name} has no constant {', '.join(constants)}")

    @classmethod
    def of(cls, family: Family, scale: ArrayLike, shape: ArrayLike) -> "Law":
        self = cls.__new__(cls)
        self.family, self.scale, self.shape = (
            family,
            numpy.asarray(scale, dtype=float),
            numpy.asarray(shape, dtype=float),
        )
        return self

    @property
    def constants(self) -> dict[str, Any]:
        """Name: value, Pa or 1; lists of ogden."""
        if self.family.name == "ogden":
            return {"mu": (2 * self.scale / self.shape).tolist(), "alpha": self.shape.tolist()}
        names = [
            "mu" if key == "shear" else key for key in (*self.family.scales, *self.family.shapes)
        ]
        return dict(zip(names, [*self.scale.tolist(), *self.shape.tolist()]))

    def __str__(self) -> str:
        return " ".join(
            f"{key}={text_of(value, 4)}" for key, value in self.constants.items() if value
        )

    @property
    def shear_modulus(self) -> float:
        """At rest, Pa."""
        return float(self.family.moduli(self.shape) @ self.scale)

    def stresses(self, e: Array) -> Array:
        """t_k [3, n], Pa, up to a pressure, of logarithms of the stretches [3, n]."""
        return numpy.tensordot(self.scale, self.family.columns(self.shape, e), 1)

    def nominal_stress(
        self, mode: str, x: ArrayLike, angle: float = 0.0, across: ArrayLike | None = None
    ) -> Array:
        """Force over the area at rest, Pa, at stretches or amounts of shear x [n]; a law without
        fibres has no angle."""
        return self.scale @ self.family.responses(self.shape, mode, x, across)

    def drucker(self, mode: str, x: ArrayLike) -> Array:
        """The lower eigenvalue of D_ab = d(t_a - t_3)/de_b, a, b = 1, 2, over the larger one of the
        upper eigenvalue and the shear modulus at rest [n]:
        negative where a small change of strain does negative work; no number beyond a limit of
        stretch."""
        e, _ = strains(mode, x)
        D = numpy.empty((2, 2) + e.shape[1:])
        step = 1e-5
        for b in range(2):
            change = numpy.zeros((3, 1))
            change[b], change[2] = step, -step
            t = (self.stresses(e + change) - self.stresses(e - change)) / (2 * step)
            D[:, b] = t[:2] - t[2]
        half, skew, off = (D[0, 0] + D[1, 1]) / 2, (D[0, 0] - D[1, 1]) / 2, (D[0, 1] + D[1, 0]) / 2
        root = numpy.hypot(skew, off)
        return (half - root) / numpy.maximum(self.shear_modulus, half + root)

    def stable(self, mode: str, low: float, high: float, angle: float = 0.0) -> tuple[float, float]:
        """(from, to): the range around rest, within low and high, in which Drucker's condition
        holds."""
        return around_rest(mode, low, high, lambda x: self.drucker(mode, x) >= LOWEST)

    def rising(self, mode: str, low: float, high: float, angle: float = 0.0) -> tuple[float, float]:
        """(from, to): the range around rest, within low and high, in which the nominal stress
        rises."""
        return around_rest(
            mode, low, high, lambda x: numpy.gradient(self.nominal_stress(mode, x), x) > 0
        )

    def option_lines(self, body: str, poisson: float = 0.4995) -> list[str]:
        """The lines of a scenario, as the program accepts them."""
        # terms of opposite signs that nearly cancel need all digits
        digits = 8 if abs(self.scale).sum() < 100 * self.shear_modulus else 17
        constants = {key: value for key, value in self.constants.items() if value or key == "c10"}
        if self.family.scales == ("shear",):
            constants = {"young": 2 * self.shear_modulus * (1 + poisson)}
        return [
            f"-body_{body}_{key} {value}"
            for key, value in [
                ("material", self.family.name),
                *((key, text_of(value, digits)) for key, value in constants.items()),
                ("poisson", f"{poisson:g}"),
            ]
        ]


def principal_range(mode: str, x: ArrayLike) -> tuple[float, float]:
    """Smallest and largest principal stretch of a test."""
    e, _ = strains(mode, x)
    return math.exp(e.min()), math.exp(e.max())
