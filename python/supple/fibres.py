"""Laws with fibres: the stress of incompressible sheets and blocks in tests of materials, as the
program's laws have it.

    law = FibreLaw("holzapfel_gasser_ogden", mu=7640, k1=996.6e3, k2=524.6, kappa=0.226,
                   angles=[49.98, -49.98])
    law.nominal_stress("uniaxial", [1.05, 1.1], angle=90)      Pa, force over the area at rest
    law.stable("uniaxial", 0.9, 1.3, angle=90), law.option_lines("wall")

f, s and n are fibre, sheet and their normal. A sheet lies in the plane of f and s; the direction d
of a test has an `angle` to f there, and e is across it.
The deformation gradient in the frame d, e, n is

    uniaxial       [[x, g, 0], [0, q, 0], [0, 0, 1/(x q)]]: a line along the pull stays one;
                   g and q leave the sides without load, t_de = 0, t_ee = t_nn
    equibiaxial, planar, biaxial     diag(x, a, 1/(x a)), a = x, 1, or the stretch across: the
                   sides of the sheet stay at right angles
    shear          I + x d e^T: the faces of normal e slide along d
    shear_fs, ..., shear_ns          I + x b a^T: the faces of normal a, the first letter, slide
                   along b, the second one (Dokos et al. 2002)

With the second Piola-Kirchhoff stress S = 2 dW/dC of C = F^T F and t = F S F^T, the nominal stress
of stretches is (t_dd - t_nn)/x, that of shears (F S)_ba.

Reference: docs/reference/materials.md has the energies and their sources; tests/verify/fit.py runs
the program beside.
What is not here: fibres that leave the plane of the sheet.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy
from numpy.typing import ArrayLike

from .laws import LOWEST, STEPS, LawError, around_rest, no_such, text_of

# iterations for the sides of a strip at most: 1 to 20 are usual, 290 where fibres without
# dispersion become taut (k2 500, a stretch of 1.3)
NEWTON = 300
LARGEST_STEP = 0.1  # of the logarithm of a stretch, and of a shear, in one of them
SIDES = 1e-11  # load of the sides that is left, over the stresses of the strip
DELTA = 1e-4  # of the differences of logarithmic strains for stability: error 1e-8 of the moduli
Array = numpy.ndarray
Constants = dict[str, Any]  # numbers or arrays, of angles a list of them
TENSION = 250.0  # largest exponent: SB_FIBRE_LIMIT of src/material/fibrous.h


def exponential(x: Array) -> Array:
    with numpy.errstate(over="ignore"):
        return numpy.where(x > TENSION, numpy.nan, numpy.exp(numpy.minimum(x, TENSION)))


def symmetric(a00: Any, a01: Any, a02: Any, a11: Any, a12: Any, a22: Any) -> Array:
    """[..., 3, 3] of its entries."""
    rows = numpy.broadcast_arrays(a00, a01, a02, a01, a11, a12, a02, a12, a22)
    return numpy.stack(rows, axis=-1).reshape(rows[0].shape + (3, 3))


def trace(C: Array) -> Array:
    return C[..., 0, 0] + C[..., 1, 1] + C[..., 2, 2]


def stress_transverse(c: Constants, C: Array) -> Array:
    matrix, shear = c["mu"], c["mu_fibre"] - c["mu"]
    along = (c["young_fibre"] - 3 * matrix) / 2 * (C[..., 0, 0] - 1)
    return symmetric(matrix + along, shear * C[..., 0, 1], shear * C[..., 0, 2], matrix, 0, matrix)


def stress_hgo(c: Constants, C: Array) -> Array:
    S = numpy.zeros(numpy.broadcast_shapes(C.shape, numpy.shape(c["mu"]) + (1, 1)))
    S += numpy.asarray(c["mu"])[..., None, None] * numpy.eye(3)
    for angle in c["angles"]:
        cos, sin, part = (
            numpy.cos(numpy.radians(angle)),
            numpy.sin(numpy.radians(angle)),
            1 - 3 * c["kappa"],
        )
        E = c["kappa"] * (trace(C) - 3) + part * (
            cos**2 * C[..., 0, 0] + sin**2 * C[..., 1, 1] + 2 * cos * sin * C[..., 0, 1] - 1
        )
        E = numpy.maximum(E, 0)
        pull = 2 * c["k1"] * E * exponential(c["k2"] * E**2)
        S += pull[..., None, None] * symmetric(
            c["kappa"] + part * cos**2,
            part * cos * sin,
            0,
            c["kappa"] + part * sin**2,
            0,
            c["kappa"],
        )
    return S


def stress_guccione(c: Constants, C: Array) -> Array:
    E = (C - numpy.eye(3)) / 2
    e00, e01, e02, e11, e12, e22 = (
        E[..., 0, 0],
        E[..., 0, 1],
        E[..., 0, 2],
        E[..., 1, 1],
        E[..., 1, 2],
        E[..., 2, 2],
    )
    bf, bt, bfs = c["bf"], c["bt"], c["bfs"]
    front = c["c"] * exponential(
        bf * e00**2 + bt * (e11**2 + e22**2 + 2 * e12**2) + 2 * bfs * (e01**2 + e02**2)
    )
    return symmetric(
        front * bf * e00,
        front * bfs * e01,
        front * bfs * e02,
        front * bt * e11,
        front * bt * e12,
        front * bt * e22,
    )


def stress_ho(c: Constants, C: Array) -> Array:
    matrix = c["a"] * exponential(c["b"] * (trace(C) - 3))

    def pull(i: str, x: Array) -> Array:
        longer = numpy.maximum(x - 1, 0)
        return 2 * c[f"a_{i}"] * longer * exponential(c[f"b_{i}"] * longer**2)

    both = c["a_fs"] * C[..., 0, 1] * exponential(c["b_fs"] * C[..., 0, 1] ** 2)
    return symmetric(
        matrix + pull("f", C[..., 0, 0]), both, 0, matrix + pull("s", C[..., 1, 1]), 0, matrix
    )


class FibreFamily:
    """A law without its constants: name; keys, its constants in the order of a fit; scales, those
    that are Pa; needed, those without a default; stress(constants, C): S of constants that are
    broadcast to those of C [..., 3, 3] without its last two axes."""

    def __init__(
        self,
        name: str,
        keys: tuple[str, ...],
        scales: tuple[str, ...],
        needed: tuple[str, ...],
        stress: Callable[[Constants, Array], Array],
    ) -> None:
        self.name, self.keys, self.scales, self.needed, self.stress = (
            name,
            keys,
            scales,
            needed,
            stress,
        )

    @property
    def nconstant(self) -> int:
        return len(self.keys)


FIBRE_LAWS = {
    law.name: law
    for law in (
        FibreFamily(
            "transversely_isotropic",
            ("mu", "mu_fibre", "young_fibre"),
            ("mu", "mu_fibre", "young_fibre"),
            ("mu", "mu_fibre", "young_fibre"),
            stress_transverse,
        ),
        FibreFamily(
            "holzapfel_gasser_ogden",
            ("mu", "k1", "k2", "kappa", "angles"),
            ("mu", "k1"),
            ("mu", "k1", "k2"),
            stress_hgo,
        ),
        FibreFamily(
            "guccione", ("c", "bf", "bt", "bfs"), ("c",), ("c", "bf", "bt", "bfs"), stress_guccione
        ),
        FibreFamily(
            "holzapfel_ogden",
            ("a", "b", "a_f", "b_f", "a_s", "b_s", "a_fs", "b_fs"),
            ("a", "a_f", "a_s", "a_fs"),
            ("a",),
            stress_ho,
        ),
    )
}


def modulus(name: str, c: Constants) -> float:
    """The mean of the shear moduli at rest over all directions, as the program has it
    (docs/reference/materials.md)."""
    if name == "transversely_isotropic":
        return c["mu"] + (c["young_fibre"] - 3 * c["mu"]) / 15 + 0.4 * (c["mu_fibre"] - c["mu"])
    if name == "guccione":
        return c["c"] * (2 / 3 * (c["bf"] + 2 * c["bt"]) + c["bt"] + 2 * c["bfs"]) / 10
    return c["a"] + c["a_fs"] / 5 if name == "holzapfel_ogden" else c["mu"]


def frame(mode: str, angle: float) -> Array:
    """Columns d, e, n [3, 3] of a test; for a shear of two letters the direction of sliding, the
    normal of the face, and the third one."""
    if mode.startswith("shear_"):
        letters = mode.partition("_")[2]
        return numpy.eye(3)[
            :,
            [
                "fsn".index(letter)
                for letter in (letters[1], letters[0], ({*"fsn"} - {*letters}).pop())
            ],
        ]
    cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return numpy.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]])


def gradient(x: Array, q: Array, g: Array) -> Array:
    """[..., 3, 3] of the stretch along, the one across and the shear."""
    zero = 0 * (x + q + g)
    return numpy.stack(
        [x + zero, g + zero, zero, zero, q + zero, zero, zero, zero, 1 / (x * q) + zero], axis=-1
    ).reshape(zero.shape + (3, 3))


def stresses(family: FibreFamily, c: Constants, R: Array, F: Array) -> Array:
    """S in the frame R of the test, of F in it."""
    C = R @ numpy.swapaxes(F, -1, -2) @ F @ R.T
    return R.T @ family.stress(c, C) @ R


def kirchhoff(family: FibreFamily, c: Constants, R: Array, F: Array) -> Array:
    return F @ stresses(family, c, R, F) @ numpy.swapaxes(F, -1, -2)


def free_sides(
    family: FibreFamily, c: Constants, R: Array, x: Array, start: Array | None = None
) -> Array:
    """(ln q, g) [2, ...] of strips whose sides bear no load, by Newton's method from `start`; nan
    where there are none."""
    shape = numpy.broadcast_shapes(numpy.shape(x), numpy.shape(c[family.keys[0]]))
    x = numpy.broadcast_to(x, shape)
    u = (
        numpy.array([-numpy.log(x) / 2, 0 * x])
        if start is None
        else numpy.where(numpy.isfinite(start), start, numpy.array([-numpy.log(x) / 2, 0 * x]))
    )

    def loads(u: Array) -> tuple[Array, Array]:
        t = kirchhoff(family, c, R, gradient(x, numpy.exp(u[0]), u[1]))
        return numpy.array([t[..., 1, 1] - t[..., 2, 2], t[..., 0, 1]]), abs(t).max(axis=(-1, -2))

    r, size = loads(u)
    for _ in range(NEWTON):
        open_ = ~(numpy.hypot(*r) <= SIDES * size)
        if not open_.any():
            return u
        h = 1e-7
        a, b = (
            (loads(u + h * numpy.array(way).reshape((2,) + (1,) * x.ndim))[0] - r) / h
            for way in ((1, 0), (0, 1))
        )
        det = a[0] * b[1] - a[1] * b[0]
        with numpy.errstate(all="ignore"):
            du = numpy.array([(b[0] * r[1] - b[1] * r[0]) / det, (a[1] * r[0] - a[0] * r[1]) / det])
            du *= numpy.minimum(1, LARGEST_STEP / abs(du).max(axis=0))
        du = numpy.where(open_ & numpy.isfinite(du), du, 0)
        # halved where the loads do not fall
        for _ in range(12):
            new, newsize = loads(u + du)
            worse = ~(numpy.hypot(*new) < numpy.hypot(*r)) & (abs(du).max(axis=0) > 0)
            if not worse.any():
                break
            du = numpy.where(worse, du / 2, du)
        # none that falls: as close as rounding lets it come
        stuck = worse & (numpy.hypot(*new) >= numpy.hypot(*r))
        u, size = u + numpy.where(stuck, 0, du), numpy.where(stuck, size, newsize)
        r = numpy.where(stuck, r, new)
        if (stuck | ~open_).all():
            break
    return numpy.where(numpy.hypot(*r) <= 1e-6 * size, u, numpy.nan)


def state(
    family: FibreFamily,
    c: Constants,
    mode: str,
    x: ArrayLike,
    angle: float = 0.0,
    across: Array | None = None,
    start: Array | None = None,
) -> tuple[Array, Array, Array | None]:
    """(R, F, sides): frame and gradients [..., 3, 3] in it of a test, and what `start` takes the
    next time."""
    R, x = frame(mode, angle), numpy.asarray(x, dtype=float)
    if mode.startswith("shear"):
        return R, gradient(numpy.ones_like(x), numpy.ones_like(x), x), None
    if mode in ("uniaxial", "compression"):
        sides = free_sides(family, c, R, x, start)
        return R, gradient(x, numpy.exp(sides[0]), sides[1]), sides
    if mode in ("equibiaxial", "planar"):
        return R, gradient(x, x if mode == "equibiaxial" else numpy.ones_like(x), 0 * x), None
    if mode != "biaxial":
        raise LawError(f"laws with fibres have no mode {mode}")
    if across is None or numpy.shape(across) != x.shape:
        raise LawError("biaxial tests need the stretch across for each point")
    return R, gradient(x, numpy.asarray(across, dtype=float), 0 * x), None


def responses(
    family: FibreFamily,
    c: Constants,
    mode: str,
    x: Array,
    angle: float = 0.0,
    across: Array | None = None,
    start: Array | None = None,
) -> tuple[Array, Array | None]:
    """(nominal stress [..., n], sides) of constants [..., 1]."""
    R, F, sides = state(family, c, mode, x, angle, across, start)
    if mode.startswith("shear"):
        return (F @ stresses(family, c, R, F))[..., 0, 1], sides
    t = kirchhoff(family, c, R, F)
    return (t[..., 0, 0] - t[..., 2, 2]) / x, sides


def exponential_of(H: Array) -> Array:
    """exp(2 H) of symmetric tensors [..., 3, 3]."""
    value, vector = numpy.linalg.eigh(H)
    return (vector * numpy.exp(2 * value)[..., None, :]) @ numpy.swapaxes(vector, -1, -2)


class FibreLaw:
    """A law with fibres and its constants, named as the program's options; angles of
    holzapfel_gasser_ogden in degrees, a list."""

    def __init__(self, name: str, **constants: Any) -> None:
        if name not in FIBRE_LAWS:
            raise LawError(no_such("law with fibres", name, FIBRE_LAWS))
        self.family = FIBRE_LAWS[name]
        unknown, missing = (
            [key for key in constants if key not in self.family.keys],
            [key for key in self.family.needed if key not in constants],
        )
        if unknown or missing:
            raise LawError(
                f"{name} has no constant {', '.join(unknown)}"
                if unknown
                else f"{name} needs {', '.join(missing)}"
            )
        self.constants: Constants = {
            key: float(constants.get(key, 0)) for key in self.family.keys if key != "angles"
        }
        if "angles" in self.family.keys:
            self.constants["angles"] = numpy.atleast_1d(
                numpy.asarray(constants.get("angles", 0), dtype=float)
            ).tolist()

    def __str__(self) -> str:
        return " ".join(
            f"{key}={text_of(value, 4)}" for key, value in self.constants.items() if value
        )

    @property
    def shear_modulus(self) -> float:
        """At rest, Pa: the mean over all directions."""
        return float(modulus(self.family.name, self.constants))

    def nominal_stress(
        self, mode: str, x: ArrayLike, angle: float = 0.0, across: Array | None = None
    ) -> Array:
        """Force over the area at rest, Pa, at stretches or amounts of shear x [n] of a test along a
        direction; nan beyond an exponent of 250."""
        return responses(
            self.family, self.constants, mode, numpy.asarray(x, dtype=float), angle, across
        )[0]

    def drucker(self, mode: str, x: Array, angle: float = 0.0) -> Array:
        """The lowest eigenvalue of the second derivative of the energy by the logarithmic strain
        ln U, over the larger one of the highest eigenvalue and the shear modulus at rest [n]:
        negative where a small change of strain at constant volume does negative work."""
        R, F, _ = state(self.family, self.constants, mode, x, angle)
        C = R @ numpy.swapaxes(F, -1, -2) @ F @ R.T
        value, vector = numpy.linalg.eigh(numpy.where(numpy.isfinite(C), C, numpy.eye(3)))
        H = (vector * (numpy.log(value) / 2)[..., None, :]) @ numpy.swapaxes(vector, -1, -2)
        # orthonormal directions without change of volume
        ways = numpy.zeros((5, 3, 3))
        ways[0], ways[1] = (
            numpy.diag([1, -1, 0]) / math.sqrt(2),
            numpy.diag([1, 1, -2]) / math.sqrt(6),
        )
        for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2)), 2):
            ways[k, i, j] = ways[k, j, i] = 1 / math.sqrt(2)
        D = numpy.zeros(x.shape + (5, 5))
        for b in range(5):
            for sign in (1, -1):
                G = H + sign * DELTA * ways[b]
                S = self.family.stress(self.constants, exponential_of(G))
                slopes = [
                    (S * (exponential_of(G + DELTA * way) - exponential_of(G - DELTA * way))).sum(
                        axis=(-1, -2)
                    )
                    / (4 * DELTA)
                    for way in ways
                ]
                D[..., b, :] += sign * numpy.stack(slopes, axis=-1) / (2 * DELTA)
        good = numpy.isfinite(D).all(axis=(-1, -2)) & numpy.isfinite(F).all(axis=(-1, -2))
        eigenvalues = numpy.linalg.eigvalsh(
            numpy.where(good[..., None, None], D + numpy.swapaxes(D, -1, -2), 0) / 2
        )
        return numpy.where(
            good,
            eigenvalues[..., 0] / numpy.maximum(2 * self.shear_modulus, eigenvalues[..., -1]),
            numpy.nan,
        )

    def stable(self, mode: str, low: float, high: float, angle: float = 0.0) -> tuple[float, float]:
        """(from, to): the range around rest, within low and high, in which small changes of strain
        do positive work."""
        return around_rest(
            mode, low, high, lambda x: self.drucker(mode, x, angle) >= LOWEST, STEPS // 4
        )

    def rising(self, mode: str, low: float, high: float, angle: float = 0.0) -> tuple[float, float]:
        """(from, to): the range around rest, within low and high, in which the nominal stress
        rises."""
        return around_rest(
            mode, low, high, lambda x: numpy.gradient(self.nominal_stress(mode, x, angle), x) > 0
        )

    def option_lines(self, body: str, poisson: float = 0.4995) -> list[str]:
        """The lines of a scenario, as the program accepts them; directions along x and y."""
        constants = {
            key: value
            for key, value in self.constants.items()
            if value or key in self.family.needed
        }
        # without its stiffness an exponent is not read
        constants = {
            key: value
            for key, value in constants.items()
            if not key.startswith("b_") or self.constants[f"a_{key[2:]}"]
        }
        return [
            f"-body_{body}_{key} {value}"
            for key, value in [
                ("material", self.family.name),
                *((key, text_of(value, 8)) for key, value in constants.items()),
                ("fibre", "1,0,0"),
                ("sheet", "0,1,0"),
                ("poisson", f"{poisson:g}"),
            ]
        ]
