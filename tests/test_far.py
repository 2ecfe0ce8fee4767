"""Ships too far to steer: answered by a box that holds their set, without the network."""

import msgspec
import numpy as np
import pytest

from companion import config
from companion.messages import FloatArray
from companion.planning import network as learned
from companion.planning.far import FAINT, Boxes, far_m
from companion.planning.network import NetworkRepulsion
from companion.planning.rows import COLUMNS
from models import sampling
from sitl.studies.case import Crossing, Readings
from sitl.studies.trials import Outcome, Part, run_part

CONFIG = config.from_mapping({"goal": {"latitude_deg": 54.0, "longitude_deg": 8.0}})
NETWORK = NetworkRepulsion.load("straight", CONFIG)
DOMAIN = {i.name: (i.low, i.high) for i in NETWORK.metadata.inputs}
UNTIL = COLUMNS.index("until_age_s")
FAR_M = far_m(CONFIG.field)


def some_rows(seed: int, n: int, low_m: float, high_m: float) -> FloatArray:
    rng = np.random.default_rng(seed)
    return sampling.place(rng, sampling.ships(rng, n, DOMAIN), low_m, high_m)


@pytest.mark.parametrize(("low_m", "high_m"), [(-50.0, 50.0), (50.0, 3000.0)])
def test_a_box_never_claims_more_distance_than_there_is(low_m: float, high_m: float) -> None:
    rows = some_rows(1, 20_000, low_m, high_m)
    tracks = sampling.tracks_of(rows)
    found = Boxes().nearest(tracks, sampling.NOW, rows[:, UNTIL], np.zeros(2))
    true_distance, true_away = sampling.exact(rows)
    outside = found.distance_m > 0
    assert (found.distance_m <= true_distance + 1e-9)[outside].all()
    off = found.distance_m > FAR_M
    assert off.sum() > 5000 or high_m < FAR_M
    assert np.hypot(found.away[:, 0], found.away[:, 1])[off] == pytest.approx(1.0)
    assert ((found.away * true_away).sum(axis=1)[off] > 0).all()


def test_what_a_far_ship_is_said_to_push_is_faint_and_never_less_than_it_is() -> None:
    rows = some_rows(2, 4000, 100.0, 1000.0)
    tracks = sampling.tracks_of(rows)
    box = Boxes().nearest(tracks, sampling.NOW, rows[:, UNTIL], np.zeros(2))
    far = box.distance_m >= FAR_M
    answer = NETWORK(tracks, sampling.NOW, rows[:, UNTIL], np.zeros(2))
    said = np.hypot(answer.velocity[:, 0], answer.velocity[:, 1])
    exact = CONFIG.field.k_r / (sampling.exact(rows)[0] - CONFIG.field.delta_m) ** 3
    assert 1000 < far.sum() < 4000
    assert (said[far] <= FAINT * CONFIG.field.k_p * (1 + 1e-9)).all()
    assert (said >= exact * (1 - 1e-9)).all()
    assert answer.from_network.all()


def test_the_network_is_asked_about_near_ships_only(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = some_rows(3, 500, 0.0, 2000.0)
    asked: list[int] = []
    run = NETWORK.run

    def counted(some: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        asked.append(len(some))
        return run(some)

    monkeypatch.setattr(NETWORK, "run", counted)
    NETWORK(sampling.tracks_of(rows), sampling.NOW, rows[:, UNTIL], np.zeros(2))
    assert 0 < asked[0] < 150


def crossings(planner: str, ships: str) -> list[Outcome]:
    case = Crossing(readings=msgspec.convert({"ships": ships}, Readings), dt_s=0.5)
    return run_part(case, 13, Part(planner, 0, 3))


@pytest.mark.parametrize(("planner", "ships"), [("network", "convoy"), ("improved", "stream")])
def test_a_crossing_is_the_same_with_every_ship_asked_about(
    planner: str, ships: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = crossings(planner, ships)
    monkeypatch.setattr(learned, "far_m", lambda _: np.inf)
    for boxed, whole in zip(found, crossings(planner, ships), strict=True):
        assert boxed.to_set_m == pytest.approx(whole.to_set_m, abs=0.01)
        assert boxed.time_s == pytest.approx(whole.time_s, abs=0.5)
