"""Vectors that are sums of products, so that two matrix products of constants make all of them at once.

Every number of the geometry is a sum of   cos(angle) * a * b   where angle, a and b are linear
in a contact's row.  The geometry is written down with the classes here; the graph then computes
all angles and lengths by one matrix, the products by two operations, and all vectors by another matrix.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.messages import FloatArray
from companion.planning.rows import COLUMNS

QUARTER = np.pi / 2


@dataclass(frozen=True, slots=True)
class Linear:
    """A sum of columns, each with its factor, and a constant."""

    factors: tuple[tuple[str, float], ...] = ()
    constant: float = 0.0

    def __add__(self, other: "Linear") -> "Linear":
        summed = dict(self.factors)
        for column, factor in other.factors:
            summed[column] = summed.get(column, 0.0) + factor
        return Linear(tuple(sorted(summed.items())), self.constant + other.constant)

    def __mul__(self, factor: float) -> "Linear":
        return Linear(tuple((c, factor * f) for c, f in self.factors), factor * self.constant)

    def __neg__(self) -> "Linear":
        return self * -1.0


def column(name: str) -> Linear:
    """A column of the row as it is."""
    return Linear(((name, 1.0),))


ONE, ZERO = Linear(constant=1.0), Linear()


@dataclass(frozen=True, slots=True)
class Product:
    """cos(angle) * a * b."""

    angle: Linear
    a: Linear
    b: Linear


@dataclass(frozen=True, slots=True)
class Sum:
    """A sum of products, each with its factor."""

    factors: tuple[tuple[Product, float], ...] = ()

    def __add__(self, other: "Sum") -> "Sum":
        summed = dict(self.factors)
        for product, factor in other.factors:
            summed[product] = summed.get(product, 0.0) + factor
        return Sum(tuple((p, f) for p, f in summed.items() if f))

    def __mul__(self, factor: float) -> "Sum":
        return Sum(tuple((p, factor * f) for p, f in self.factors))

    def __sub__(self, other: "Sum") -> "Sum":
        return self + other * -1.0


Vector = tuple[Sum, Sum]
NOTHING: Vector = (Sum(), Sum())


def scalar(a: Linear, b: Linear = ONE) -> Sum:
    """a * b."""
    return Sum(((Product(ZERO, a, b), 1.0),))


def polar(angle: Linear, a: Linear = ONE, b: Linear = ONE) -> Vector:
    """The vector of length a * b at that angle, clockwise from the first axis."""
    quarter_back = angle + Linear(constant=-QUARTER)
    return Sum(((Product(angle, a, b), 1.0),)), Sum(((Product(quarter_back, a, b), 1.0),))


def right(v: Vector) -> Vector:
    """The vector a quarter turn clockwise."""
    return v[1] * -1.0, v[0]


def add(v: Vector, w: Vector, factor: float = 1.0) -> Vector:
    """v + factor * w."""
    return v[0] + w[0] * factor, v[1] + w[1] * factor


def scaled(v: Vector, factor: float) -> Vector:
    """factor * v."""
    return v[0] * factor, v[1] * factor


class Plan:
    """The constants of both matrices for a list of vectors."""

    def __init__(self, vectors: Sequence[Vector]) -> None:
        self._vectors = vectors
        self.products = list(dict.fromkeys(p for v in vectors for part in v for p, _ in part.factors))

    def linear(self, extra: Sequence[Linear] = ()) -> tuple[FloatArray, FloatArray]:
        """Matrix (15, 3 m + extra) and offset of angles, a and b of the m products, then the extra ones."""
        terms = [getattr(p, part) for part in ("angle", "a", "b") for p in self.products] + list(extra)
        matrix = np.zeros((len(COLUMNS), len(terms)))
        for i, term in enumerate(terms):
            for name, factor in term.factors:
                matrix[COLUMNS.index(name), i] = factor
        return matrix, np.array([term.constant for term in terms])

    def sums(self) -> FloatArray:
        """Matrix (m, 2 Q): both parts of the first of Q vectors, of the second, and so on."""
        at = {p: i for i, p in enumerate(self.products)}
        matrix = np.zeros((len(self.products), len(self._vectors), 2))
        for q, vector in enumerate(self._vectors):
            for side, part in enumerate(vector):
                for product, factor in part.factors:
                    matrix[at[product], q, side] = factor
        return matrix.reshape(len(self.products), -1)
