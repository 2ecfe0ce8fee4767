"""The learned part: how a unit of reach looks from each grid direction, given the course noise.

The velocities of a ship at unit speed fill the arc of directions within +-w of its course.  The arc's
support in direction b is N(w) = cos(max(|b| - w, 0)).  The network learns it for each grid direction
in [0, pi]; the other side is its mirror image.
"""

from itertools import pairwise

import numpy as np
import torch
from torch import nn

from companion.messages import FloatArray
from models.bounds import teacher
from models.checkpoint import Checkpoint
from models.layers import Layers
from models.loop import Progress, descend
from models.spec import SupportSpec


def train(spec: SupportSpec, checkpoint: Checkpoint | None, progress: Progress) -> Layers:
    """Adam on all layers, then the last one by least squares; the same seed gives the same layers."""
    network, widest = spec.network, spec.course_noise_max_rad
    torch.manual_seed(spec.seed)
    sizes = (1, *network.hidden, network.grid // 2 + 1)
    linear = [nn.Linear(a, b, dtype=torch.float64) for a, b in pairwise(sizes)]
    body = nn.Sequential(*(part for layer in linear[:-1] for part in (layer, nn.Tanh())))
    whole = nn.Sequential(body, linear[-1])

    none = torch.from_numpy(teacher(np.zeros(1), network.grid))  # the support without noise

    def batch(noise: FloatArray) -> tuple[torch.Tensor, torch.Tensor]:
        return torch.from_numpy(2 * noise[:, None] / widest - 1), torch.from_numpy(
            teacher(noise, network.grid)
        )

    def loss_on(rng: np.random.Generator) -> torch.Tensor:
        scaled, target = batch(rng.uniform(0, widest, network.samples))
        loss: torch.Tensor = ((whole(scaled) - (target - none)) / widest).square().mean()
        return loss

    descend(
        whole,
        loss_on,
        steps=network.adam_steps,
        rate=network.adam_rate,
        decay=False,
        seed=spec.seed,
        checkpoint=checkpoint,
        progress=progress,
    )
    with torch.no_grad():
        for layer in linear[:-1]:  # round before the last layer is fitted to what the others give
            layer.weight.copy_(layer.weight.float())
            layer.bias.copy_(layer.bias.float())
        nodes = np.cos(np.linspace(0, np.pi, 4 * network.samples))  # denser at the range's ends
        scaled, target = batch((nodes + 1) / 2 * widest)
        features = torch.cat([body(scaled), torch.ones_like(scaled)], dim=1)
        gram = features.T @ features / len(features)
        gram += network.ridge * torch.eye(len(gram), dtype=torch.float64)
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
