"""The turning network: never beyond the exact slabs, close to them, certified, used and recorded."""

import hashlib
import math
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion import build, config
from companion.errors import ModelError
from companion.messages import FloatArray, Model
from companion.planning import certificate, turning_proof
from companion.planning.field import ExactRepulsion
from companion.planning.model_file import read_bytes
from companion.planning.network import TURNING_KEY, Network, NetworkRepulsion
from companion.planning.onnx_weights import float_constants
from companion.planning.rows import TURNING_COLUMNS
from companion.record.session import session
from models import certify, sampling, soundness, turning_bounds
from models.evaluate import degrees_between
from models.layers import Layers
from tests.ships import plane, swing

GOAL: dict[str, object] = {"goal": {"latitude_deg": 54.0, "longitude_deg": 8.0}}
CONFIG = config.from_mapping(GOAL)
CONTENT = read_bytes("turning")[1]
NETWORK = Network.load("turning", CONFIG, TURNING_KEY)
DOMAIN = {i.name: (i.low, i.high) for i in NETWORK.metadata.inputs}
UNTIL = TURNING_COLUMNS.index("until_age_s")


def some_rows(seed: int, n: int, low_m: float = 5.0, high_m: float = 10.0) -> FloatArray:
    return sampling.around(np.random.default_rng(seed), n, DOMAIN, low_m, high_m)


@pytest.mark.parametrize(("low_m", "high_m"), [(5.0, 10.0), (-30.0, 5.0), (0.0, 5000.0)])
def test_it_never_claims_more_distance_than_the_exact_slabs(low_m: float, high_m: float) -> None:
    rows = some_rows(1, 600, low_m, high_m)
    distance, away, _ = NETWORK.run(rows)
    assert (distance <= sampling.exact(rows)[0]).all()
    assert np.hypot(*away.T) == pytest.approx(1.0, abs=1e-6)


def test_no_sampled_turning_ship_comes_nearer_than_it_claims() -> None:
    rng = np.random.default_rng(4)
    ships = sampling.ships(rng, 30, DOMAIN)
    ships[:, UNTIL] = np.minimum(ships[:, UNTIL], ships[:, 4] + 300.0)
    ships[:, 15:] *= 0.99
    for i, row in enumerate(ships):
        row[:2] = 0.0
        tracks = sampling.tracks_of(ships)
        reached = plane(swing(rng, tracks, i, row[4], max(row[4], row[UNTIL]), 300))
        rows = np.repeat(row[None], 10, axis=0)
        rows[:, :2] = reached[:10] + rng.normal(scale=30.0, size=(10, 2))
        nearest = np.hypot(*(rows[:, None, :2] - reached).transpose(2, 0, 1)).min(axis=1)
        assert (NETWORK.run(rows)[0] <= nearest + 1e-6).all()


def test_at_five_to_ten_metres_it_is_within_half_a_metre_and_two_degrees_nearly_always() -> None:
    rows = some_rows(2, 2000)
    distance, away, _ = NETWORK.run(rows)
    true_distance, true_away = sampling.exact(rows)
    near = true_distance > 4.9
    assert near.mean() > 0.9
    assert np.percentile((true_distance - distance)[near], 99) <= 0.5
    assert np.percentile(degrees_between(away, true_away)[near], 99) <= 2.0


@settings(max_examples=60, deadline=None)
@given(
    corner=st.lists(st.booleans(), min_size=17, max_size=17),
    bearing=st.floats(-math.pi, math.pi),
    length=st.floats(0.0, 20_000.0).map(lambda metres: round(metres, 3)),
    until=st.sampled_from([0.0, 1.0, 10.0, 120.0, 1200.0]),
    share=st.sampled_from([0.0, 0.3, 1.0]),
)
def test_at_every_corner_of_the_domain_it_stays_below_the_slabs(
    corner: list[bool], bearing: float, length: float, until: float, share: float
) -> None:
    row = np.array([[DOMAIN[name][side] for name, side in zip(TURNING_COLUMNS, corner, strict=True)]])
    row[0, :2] = length * math.cos(bearing), length * math.sin(bearing)
    row[0, 4], row[0, UNTIL] = row[0, 4] * until / 1200.0, until
    row[0, 6] = min(row[0, 6], row[0, 3])
    room = (math.pi - 2 * row[0, 7]) / (until + 1.0)
    row[0, 15] = math.copysign(min(share * room, 0.1), row[0, 15])
    row[0, 16] = min((room - abs(row[0, 15])) / 2, 0.05) if corner[16] else 0.0
    assert NETWORK.in_range(row).all()
    assert NETWORK.run(row)[0][0] <= sampling.exact(row)[0][0]


def test_courses_over_more_than_half_a_turn_are_out_of_range() -> None:
    row = some_rows(5, 1)
    row[0, [4, UNTIL, 7]] = 0.0, 100.0, 0.05
    row[0, 15:] = 0.0302, 0.0001
    assert NETWORK.in_range(row).all()
    row[0, 15] = 0.0304
    assert not NETWORK.in_range(row).any()


def test_both_networks_answer_for_their_ships_and_the_exact_field_for_the_rest() -> None:
    rows = some_rows(6, 12)
    tracks = sampling.tracks_of(rows)
    model = np.array([int(Model.TURNING), int(Model.STRAIGHT), int(Model.DISC)] * 4)
    rate = tracks.turn_rate_radps.copy()
    rate[0] = 0.5  # out of range
    noise = np.minimum(tracks.course_noise_rad, 0.05)
    heading = np.full(12, np.pi)
    tracks = replace(
        tracks, model=model, turn_rate_radps=rate, course_noise_rad=noise, heading_error_rad=heading
    )
    here = np.zeros(2)
    answer = NetworkRepulsion.load("straight", CONFIG)(tracks, sampling.NOW, rows[:, UNTIL], here)
    exact = ExactRepulsion(CONFIG.field)(tracks, sampling.NOW, rows[:, UNTIL], here)
    assert answer.from_network.tolist() == [False, True, False] + [True, True, False] * 3
    assert (answer.nearest.distance_m <= exact.nearest.distance_m).all()
    alone = ~answer.from_network
    np.testing.assert_array_equal(answer.velocity[alone], exact.velocity[alone])
    without = config.from_mapping({**GOAL, "repulsion": {"turning_model": ""}})
    plain = NetworkRepulsion.load("straight", without)(tracks, sampling.NOW, rows[:, UNTIL], here)
    assert plain.from_network.tolist() == [False, True, False] * 4


@pytest.mark.parametrize(("key", "name"), [("model", "turning"), ("turning_model", "straight")])
def test_a_model_in_the_others_place_is_refused_at_start(key: str, name: str) -> None:
    wrong = config.from_mapping({**GOAL, "repulsion": {key: name}})
    with pytest.raises(ModelError, match=rf"repulsion\.{key} = '{name}'"):
        build.build(wrong)


def test_both_digests_are_in_the_log() -> None:
    companion = build.build(CONFIG)
    first = session(CONFIG, companion.model_digest, companion.turning_digest)
    assert first.turning_model_sha256 == hashlib.sha256(CONTENT).hexdigest()
    assert first.model_sha256 != first.turning_model_sha256


# ---------------------------------------------------------------- certificate


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    path = tmp_path / "copy.onnx"
    path.write_bytes(CONTENT)
    held = certificate.check("turning")
    path.with_suffix(certificate.SUFFIX).write_bytes(msgspec.json.encode(held))
    return path


def with_weight(name: str, index: int, change: float) -> bytes:
    values = float_constants(CONTENT)[name].astype("<f4")
    at = CONTENT.index(values.tobytes()) + 4 * index
    return CONTENT[:at] + np.float32(values.ravel()[index] + change).tobytes() + CONTENT[at + 4 :]


def test_it_is_certified_below_nine_centimetres_up_to_twelve_metres_a_second_and_ten_minutes() -> None:
    held = certificate.check("turning")
    assert held.eps_m["speed 0.5-12 m/s with 0.05 m/s noise, T = 600 s"] <= 0.09
    assert held.domain == DOMAIN


def test_making_the_certificate_again_gives_the_same_one(copy: Path) -> None:
    assert certify.run(copy) == certificate.check("turning")


@pytest.mark.parametrize(
    ("name", "index", "change"),
    [
        ("weight0", 5, 1e-3),
        ("bias0", 2, 1e-3),
        ("weight1", 3, -1e-3),
        ("bias1", 0, -1e-4),
        ("most_above", 0, -3e-6),
    ],
)
def test_one_changed_weight_is_refused_even_under_a_fresh_seal(
    copy: Path, name: str, index: int, change: float
) -> None:
    changed = with_weight(name, index, change)
    copy.write_bytes(changed)
    with pytest.raises(ModelError, match="another file"):
        certificate.check(copy)
    digest = hashlib.sha256(changed).hexdigest()
    held = msgspec.structs.replace(certificate.check("turning"), model_sha256=digest).sealed()
    copy.with_suffix(certificate.SUFFIX).write_bytes(msgspec.json.encode(held))
    with pytest.raises(ModelError, match="does not hold"):
        certificate.check(copy)


def test_both_proofs_enclose_what_dense_sampling_finds() -> None:
    inner, offset, outer, constant, most_above = turning_proof.learned_mean_cosine(CONTENT)
    layers = Layers((inner, outer[:, None]), (offset, np.array([constant])))
    sweep = np.sort(np.random.default_rng(0).uniform(0, np.pi / 2, (50_000, 2)), axis=1)
    error = turning_bounds.forward(layers, *sweep.T) - turning_bounds.teacher(*sweep.T)
    made, (low, high, _) = turning_bounds.enclose(layers, 4e-7), turning_proof.enclose(CONTENT)
    assert 0 <= low <= error.min()
    assert 0 <= made.low <= error.min()
    assert error.max() <= min(made.high, high)
    assert max(made.high, high) <= most_above


def test_the_proofs_derivatives_are_those_of_the_mean_cosine() -> None:
    x, y, h = np.array([0.2, 0.7, 1.0]), np.array([0.9, 0.7, 1.5]), 1e-4
    t, by_x, by_y, by_xx, by_yy, by_xy = turning_proof.mean_cosine(x, y)
    true = turning_bounds.teacher

    assert t == pytest.approx(true(x, y), abs=1e-12)
    assert by_x == pytest.approx((true(x + h, y) - true(x - h, y)) / (2 * h), abs=1e-7)
    assert by_y == pytest.approx((true(x, y + h) - true(x, y - h)) / (2 * h), abs=1e-7)
    assert by_xx == pytest.approx((true(x + h, y) - 2 * t + true(x - h, y)) / h**2, abs=1e-6)
    assert by_yy == pytest.approx((true(x, y + h) - 2 * t + true(x, y - h)) / h**2, abs=1e-6)
    mixed = true(x + h, y + h) - true(x + h, y - h) - true(x - h, y + h) + true(x - h, y - h)
    assert by_xy == pytest.approx(mixed / (4 * h * h), abs=1e-6)


def test_the_soundness_run_finds_no_unsafe_point(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(soundness, "PLACES", 100)
    assert soundness.run("turning", 3000, seed=5).unsafe == 0
