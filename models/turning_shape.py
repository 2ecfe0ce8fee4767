"""The learned part of the turning network: the mean of the cosine over a sweep of angles.

    T(x, y) = (sin y - sin x) / (y - x),   0 <= x <= y <= pi/2

One hidden layer of tanh.  Adam brings it near, Levenberg and Marquardt's method to the end: with fifty
weights it reaches an error of 1e-6, which is millimetres per kilometre sailed.
"""

import numpy as np
import torch
from torch import nn

from companion.messages import FloatArray
from models.checkpoint import Checkpoint
from models.layers import Layers
from models.loop import Progress, descend
from models.spec import TurningNetwork, TurningSpec
from models.turning_bounds import teacher

HALF = np.pi / 2
SCALE = np.array([[2 / HALF, 0.0, 0.0], [0.0, 2 / HALF, 0.0], [-1.0, -1.0, 1.0]])  # angles to [-1, 1], and 1
FIRST_RIDGE, LAST_RIDGE = 1e-6, 1e-15
LEAST_DAMPING, MOST_DAMPING = 1e-14, 1e10


def train(spec: TurningSpec, checkpoint: Checkpoint | None, progress: Progress) -> Layers:
    """The same seed gives the same layers; weights (2, hidden) and (hidden, 1), rounded to float32."""
    network = spec.network
    torch.manual_seed(spec.seed)
    first, last = (
        nn.Linear(a, b, dtype=torch.float64) for a, b in ((2, network.hidden), (network.hidden, 1))
    )
    whole = nn.Sequential(first, nn.Tanh(), last)

    def loss_on(rng: np.random.Generator) -> torch.Tensor:
        sweep = np.sort(rng.uniform(0, HALF, (network.samples, 2)), axis=1)
        out = whole(torch.from_numpy(2 * sweep / HALF - 1))
        loss: torch.Tensor = (out - torch.from_numpy(teacher(*sweep.T))[:, None]).square().mean()
        return loss

    descend(
        whole,
        loss_on,
        steps=network.adam_steps,
        rate=network.adam_rate,
        decay=True,
        seed=spec.seed,
        checkpoint=checkpoint,
        progress=progress,
    )
    with torch.no_grad():
        inner = np.concatenate((first.weight.T.numpy(), first.bias.numpy()[None]))
        outer = np.concatenate((last.weight.numpy()[0], last.bias.numpy()))
    inner, outer = settle(network, inner, outer, progress)
    inner = SCALE @ inner
    return Layers(
        (_round32(inner[:2]), _round32(outer[:-1, None])), (_round32(inner[2]), _round32(outer[-1:]))
    )


def settle(
    network: TurningNetwork, inner: FloatArray, outer: FloatArray, progress: Progress
) -> tuple[FloatArray, FloatArray]:
    """Least squares over a grid that is denser at the ends; `inner` (3, hidden), `outer` (hidden + 1,).

    A ridge that fades keeps the weights small: what swings wide can hardly be enclosed.
    """
    ends = (1 - np.cos(np.linspace(0, np.pi, network.nodes))) / 2 * HALF
    x, y = np.meshgrid(ends, ends)
    sweep = np.column_stack((x[x <= y], y[x <= y]))
    features = np.column_stack((sweep, np.ones(len(sweep)))) @ SCALE
    target, damping = teacher(*sweep.T), 1e-2

    def errors(weights: FloatArray, ridge: float) -> tuple[FloatArray, FloatArray, float]:
        layer = np.tanh(features @ weights[: inner.size].reshape(inner.shape))
        off = layer @ weights[inner.size : -1] + weights[-1] - target
        return layer, off, float(off @ off + ridge * weights @ weights)

    weights = np.concatenate((inner.ravel(), outer))
    for step in range(network.fit_steps):
        ridge = FIRST_RIDGE * (LAST_RIDGE / FIRST_RIDGE) ** (step / network.fit_steps)
        layer, off, cost = errors(weights, ridge)
        slope = (1 - layer * layer) * weights[inner.size : -1]
        jacobian = (features[:, :, None] * slope[:, None, :]).reshape(len(sweep), -1)
        jacobian = np.concatenate((jacobian, layer, np.ones((len(sweep), 1))), axis=1)
        curvature = jacobian.T @ jacobian + ridge * np.eye(len(weights))
        gradient = jacobian.T @ off + ridge * weights
        while damping < MOST_DAMPING:
            move = np.linalg.solve(curvature + damping * np.diag(np.diag(curvature) + 1e-12), gradient)
            if errors(weights - move, ridge)[2] < cost:
                weights = weights - move
                break
            damping *= 4
        damping = min(max(damping / 3, LEAST_DAMPING), 1.0)
        if step % 100 == 0:
            progress("fit", step / network.fit_steps, f"greatest error {np.abs(off).max():.3g}")
    return weights[: inner.size].reshape(inner.shape), weights[inner.size :]


def _round32(values: FloatArray) -> FloatArray:
    return np.asarray(values, dtype=np.float64).astype(np.float32).astype(np.float64)
