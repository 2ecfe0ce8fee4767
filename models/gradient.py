"""The paper's way: a deep, narrow ReLU network that returns the repulsive gradient itself.

Kept as the baseline of the tables.  The paper's shape (equal layers between a linear input and a
linear output), helped by what it needs to learn anything at all: the ship's course frame, training
points crowded near the set, and forces on a logarithmic scale.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from companion.messages import FloatArray
from companion.planning.field import repulsion_strength
from companion.planning.rows import COLUMNS, TURNING_COLUMNS
from models import sampling
from models.checkpoint import Checkpoint
from models.loop import Progress, descend
from models.spec import GradientSpec

AGE, COURSE = COLUMNS.index("age_s"), COLUMNS.index("course_rad")
FEATURES = 3  # forward, starboard, age; of ships that turn the rate too
PLACES = 512  # around a ship that turns, whose set is expensive


@dataclass(frozen=True, slots=True)
class Dense:
    """ReLU layers, the last linear; weights (inputs, outputs)."""

    weights: tuple[FloatArray, ...]
    biases: tuple[FloatArray, ...]
    length_m: float  # scales of the features
    time_s: float
    top: float  # scale of the logarithmic force


def train(spec: GradientSpec, checkpoint: Checkpoint | None, progress: Progress) -> Dense:
    """Adam with a cosine decay on points drawn on the fly from the exact field."""
    network = spec.network
    torch.manual_seed(spec.seed)
    parts: list[nn.Module] = []
    width = FEATURES + (tuple(spec.domain) == TURNING_COLUMNS)
    for _ in range(network.layers):
        layer = nn.Linear(width, network.width)
        nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
        parts += [layer, nn.ReLU()]
        width = network.width
    whole = nn.Sequential(*parts, nn.Linear(width, 2))
    length_m = spec.domain["speed_mps"][1] * spec.domain["until_age_s"][1]
    time_s = spec.domain["age_s"][1]
    top = float(
        np.log1p(repulsion_strength(np.zeros(1), spec.field.k_r, spec.field.delta_m)[0] / network.floor)
    )

    def loss_on(rng: np.random.Generator) -> torch.Tensor:
        rows, force = examples(spec, rng, network.batch)
        strength = np.hypot(force[:, 0], force[:, 1])[:, None]
        target = force / strength * np.log1p(strength / network.floor) / top
        features = np.column_stack((in_course_frame(rows, rows[:, :2]) / length_m, rows[:, AGE] / time_s))
        if rows.shape[1] > len(COLUMNS):
            features = np.column_stack((features, rows[:, len(COLUMNS)] * time_s))
        out = whole(torch.from_numpy(features.astype(np.float32)))
        loss: torch.Tensor = (out - torch.from_numpy(target.astype(np.float32))).square().mean()
        return loss

    descend(
        whole,
        loss_on,
        steps=network.steps,
        rate=network.rate,
        decay=True,
        seed=spec.seed,
        checkpoint=checkpoint,
        progress=progress,
    )
    linear = [part for part in whole if isinstance(part, nn.Linear)]
    with torch.no_grad():
        return Dense(
            tuple(layer.weight.T.double().numpy().copy() for layer in linear),
            tuple(layer.bias.double().numpy().copy() for layer in linear),
            length_m,
            time_s,
            top,
        )


def examples(spec: GradientSpec, rng: np.random.Generator, n: int) -> tuple[FloatArray, FloatArray]:
    """Rows (n, 15 or 17) and the exact repulsion (n, 2) in the course frame."""
    near_m, far_m = spec.network.near_m, spec.network.far_m
    if tuple(spec.domain) == TURNING_COLUMNS:
        ships = sampling.ships(rng, n // PLACES, spec.domain)
        crowds = [sampling.crowded(rng, ship, PLACES, near_m, far_m, logarithmic=True) for ship in ships]
        rows, distance, away = (np.concatenate(part) for part in zip(*crowds, strict=True))
    else:
        rows = sampling.place(rng, sampling.ships(rng, n, spec.domain), near_m, far_m, logarithmic=True)
        distance, away = sampling.exact(rows)
    strength = repulsion_strength(distance, spec.field.k_r, spec.field.delta_m)
    return rows, in_course_frame(rows, strength[:, None] * away)


def in_course_frame(rows: FloatArray, vectors: FloatArray) -> FloatArray:
    """(n, 2) north-east vectors as (along the course, to starboard)."""
    cos, sin = np.cos(rows[:, COURSE]), np.sin(rows[:, COURSE])
    north, east = vectors.T
    return np.column_stack((north * cos + east * sin, east * cos - north * sin))
