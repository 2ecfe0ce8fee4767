"""The page on adding an obstacle model: its example is run as it stands there."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from companion import reach
from companion.messages import Tracks
from companion.reach import shapes
from tests.builders import T0
from tests.ships import hull_points, plane, random_ships

PAGE = Path(__file__).parents[1] / "docs" / "obstacle_models.md"
DRIFTING = 99


@pytest.fixture
def drifting(monkeypatch: pytest.MonkeyPatch) -> Tracks:
    """Ships of the page's model, which is registered for the length of a test."""
    code = PAGE.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    names: dict[str, Any] = {"__name__": "page"}
    exec(compile(code, str(PAGE), "exec"), names)
    models: dict[Any, Any] = shapes.MODELS
    monkeypatch.setitem(models, DRIFTING, names["drifting_shapes"])
    rng = np.random.default_rng(1)
    return random_ships(rng, 30, model=np.full(30, DRIFTING), sog_mps=rng.uniform(0, 2, 30))


def test_no_drifting_ship_escapes_the_pages_set(drifting: Tracks) -> None:
    rng, age = np.random.default_rng(2), drifting.age_s(T0)
    sets = reach.tube(drifting, T0, age + 200.0)
    for i in range(len(drifting)):
        tau = age[i] + rng.choice([0.0, 100.0, 200.0], 500)
        noise = drifting.speed_noise_mps[i] * np.exp(2j * np.pi * rng.random(500))
        run = tau * (drifting.sog_mps[i] * np.exp(1j * drifting.cog_rad[i]) + noise)
        hull = hull_points(rng, drifting, i, 500, 2 * np.pi * rng.random(500))
        points = plane(drifting.north_m[i] + 1j * drifting.east_m[i] + run + hull)
        distance, _ = sets.nearest_many(points)
        assert distance[:, i].max() <= 1e-9


def test_the_pages_distance_is_that_of_its_support(drifting: Tracks) -> None:
    rng = np.random.default_rng(3)
    sets = reach.tube(drifting, T0, drifting.age_s(T0) + 200.0)
    angle = np.linspace(0, 2 * np.pi, 720)
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    for _ in range(20):
        position = np.column_stack((drifting.north_m, drifting.east_m)) + rng.normal(0, 600, (30, 2))
        nearest = sets.nearest(position)
        gap = position @ normal.T - sets.support(normal)
        assert (nearest.distance_m - gap.max(axis=1)).min() >= -1e-9
        attained = (position * nearest.away).sum(axis=1) - np.diag(sets.support(nearest.away))
        assert attained == pytest.approx(nearest.distance_m, abs=1e-6)


def test_the_page_lists_every_model() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert all(f"`{model.name}`" in page for model in shapes.MODELS)
