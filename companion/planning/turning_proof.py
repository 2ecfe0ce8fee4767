"""The turning network's certificate, proven again: a fixed grid and Taylor's formula, no torch.

What is proven, for every sweep of angles 0 <= x <= y <= pi/2:

    0 <= T^(x, y) - T(x, y) <= eps,        T = mean of the cosine over [x, y]

The support of a slab [a, b] (`companion.reach.turning`) is, with F the greatest distance run to b and S
the least run to a, both in closed form,

    h = F (P1 + P2 - 1) - S (M1 + M2)

P and M being shares of sweeps times T.  The graph puts T^ for T ahead, and T^ less its constant
`most_above` astern.  With most_above >= eps the learned h is nowhere below the true one and nowhere more
than  2 eps F + most_above S  above; each slab's distance, and so the least of them, is nowhere too long.

T is an average of cosines, so the sum of its third derivatives in any direction |dx|, |dy| <= r is at most
r^3; a tanh has |tanh'''| <= 2.
"""

import numpy as np

from companion.messages import FloatArray
from companion.planning.onnx_weights import float_constants

CELLS = 1000  # in either angle
ROUNDING = 1e-12
CHUNK = 20_000
MOST_ABOVE = "most_above"


def learned_mean_cosine(content: bytes) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
    """Weights (2, H), biases (H,), weights (H,), bias, and the constant taken off astern."""
    found = float_constants(content)
    weights, biases = (found["weight0"], found["weight1"]), (found["bias0"].ravel(), found["bias1"].ravel())
    hidden = len(biases[0])
    if weights[0].shape != (2, hidden) or weights[1].shape != (hidden, 1) or "weight2" in found:
        raise ValueError("weights of one hidden layer over two angles not found")
    return weights[0], biases[0], weights[1][:, 0], float(biases[1][0]), float(found[MOST_ABOVE].ravel()[0])


def enclose(content: bytes) -> tuple[float, float, float]:
    """Bounds of learned minus true mean cosine over all sweeps, and the constant taken off astern."""
    inner, offset, outer, constant, most_above = learned_mean_cosine(content)
    half = np.pi / 2 / CELLS / 2
    side = (2 * np.arange(CELLS) + 1) * half
    x, y = (v.ravel() for v in np.meshgrid(side, side))
    x, y = x[x <= y], y[x <= y]  # a cell on the diagonal is taken whole
    steep = half * np.abs(inner).sum(axis=0)
    third = float((2 * np.abs(outer) * steep**3).sum() + half**3) / 6
    low, high = np.inf, -np.inf
    for first in range(0, len(x), CHUNK):
        u, v = x[first : first + CHUNK], y[first : first + CHUNK]
        layer = np.tanh(np.column_stack((u, v)) @ inner + offset)
        slope = (1 - layer * layer) * outer
        bend = -2 * layer * slope
        true = mean_cosine(u, v)
        error = layer @ outer + constant - true[0]
        tilt = np.abs(slope @ inner[0] - true[1]) + np.abs(slope @ inner[1] - true[2])
        squares = np.abs(bend @ inner[0] ** 2 - true[3]) + np.abs(bend @ inner[1] ** 2 - true[4])
        product = np.abs(bend @ (inner[0] * inner[1]) - true[5])
        spread = tilt * half + (squares + 2 * product) * half * half / 2 + third + ROUNDING
        low, high = min(low, float((error - spread).min())), max(high, float((error + spread).max()))
    return low, high, most_above


def mean_cosine(x: FloatArray, y: FloatArray) -> tuple[FloatArray, ...]:
    """T and its derivatives by x, y, xx, yy, xy, by Gauss's rule of twelve points: exact to 1e-15."""
    node, weight = np.polynomial.legendre.leggauss(12)
    share, weight = (node + 1) / 2, weight / 2
    angle = x[:, None] + (y - x)[:, None] * share
    cos, sin = np.cos(angle), np.sin(angle)
    rest = 1 - share
    return (
        cos @ weight,
        -sin @ (weight * rest),
        -sin @ (weight * share),
        -cos @ (weight * rest * rest),
        -cos @ (weight * share * share),
        -cos @ (weight * share * rest),
    )
