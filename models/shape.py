"""The learned part: how a unit of reach looks from each grid direction, given the course noise.

The velocities of a ship at unit speed fill the arc of directions within +-w of its course.  The arc's
support in direction b is cos(max(|b| - w, 0)); without noise it is cos b.  The network learns the
difference N(w), one value for each grid direction in [0, pi]; the other side is its mirror image.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import torch
from torch import nn

from companion.messages import FloatArray
from models.spec import Network
from models.support_graph import Layers, grid_angles


def true_corrections(course_noise_rad: FloatArray, grid: int) -> FloatArray:
    """(..., K/2 + 1) the teacher: N for noises (...)."""
    angles = grid_angles(grid)[: grid // 2 + 1]
    return np.cos(np.maximum(angles - course_noise_rad[..., None], 0.0)) - np.cos(angles)


def train(
    spec: Network, course_noise_max_rad: float, seed: int, progress: Callable[[int, float], None]
) -> Layers:
    """Adam on all layers, then the last one by least squares; the same seed gives the same layers."""
    rng = np.random.default_rng(seed)
    torch.manual_seed(seed)
    sizes = (1, *spec.hidden, spec.grid // 2 + 1)
    linear = [nn.Linear(a, b, dtype=torch.float64) for a, b in pairwise(sizes)]
    body = nn.Sequential(*(part for layer in linear[:-1] for part in (layer, nn.Tanh())))

    def batch(noise: FloatArray) -> tuple[torch.Tensor, torch.Tensor]:
        scaled = 2 * noise[:, None] / course_noise_max_rad - 1
        return torch.from_numpy(scaled), torch.from_numpy(true_corrections(noise, spec.grid))

    optimizer = torch.optim.Adam([p for layer in linear for p in layer.parameters()], spec.adam_rate)
    for step in range(spec.adam_steps):
        scaled, target = batch(rng.uniform(0, course_noise_max_rad, spec.samples))
        loss = ((linear[-1](body(scaled)) - target) / course_noise_max_rad).square().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        progress(step + 1, float(loss.detach()))

    with torch.no_grad():
        for layer in linear[:-1]:  # round before the last layer is fitted to what the others give
            layer.weight.copy_(layer.weight.float())
            layer.bias.copy_(layer.bias.float())
        nodes = np.cos(np.linspace(0, np.pi, 4 * spec.samples))  # denser at the range's ends
        scaled, target = batch((nodes + 1) / 2 * course_noise_max_rad)
        features = torch.cat([body(scaled), torch.ones_like(scaled)], dim=1)
        gram = features.T @ features / len(features)
        gram += spec.ridge * torch.eye(len(gram), dtype=torch.float64)
        fitted = torch.linalg.solve(gram, features.T @ target / len(features))
        weights = [layer.weight.T.numpy().copy() for layer in linear[:-1]] + [fitted[:-1].numpy()]
        biases = [layer.bias.numpy().copy() for layer in linear[:-1]] + [fitted[-1].numpy()]
    return Layers(tuple(map(_round32, weights)), tuple(map(_round32, biases)))


def raised(layers: Layers, shift: FloatArray) -> Layers:
    """The same network with its outputs moved up by `shift` (K/2 + 1,), rounded up to float32."""
    wanted = layers.biases[-1] + shift
    nearest = wanted.astype(np.float32)
    up = np.where(nearest < wanted, np.nextafter(nearest, np.float32(np.inf)), nearest)
    return Layers(layers.weights, (*layers.biases[:-1], up.astype(np.float64)))


def _round32(values: FloatArray) -> FloatArray:
    return np.asarray(values, dtype=np.float64).astype(np.float32).astype(np.float64)
