"""The learned field at run time: conservative, deterministic, refused when it does not fit."""

import math
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion import config, reach
from companion.errors import ModelError
from companion.instant import after
from companion.messages import FloatArray, Model, Tracks
from companion.planning import model_file
from companion.planning.far import far_m
from companion.planning.field import ExactRepulsion, repulsion_strength
from companion.planning.network import INPUT, OUTPUTS, NetworkRepulsion, open_session
from companion.planning.rows import COLUMNS, ContactRows, as_circles
from models import sampling, soundness

CONFIG = config.from_mapping({"goal": {"latitude_deg": 54.0, "longitude_deg": 8.0}})
NETWORK = NetworkRepulsion.load("straight", CONFIG)
DOMAIN = {i.name: (i.low, i.high) for i in NETWORK.metadata.inputs}
UNTIL = COLUMNS.index("until_age_s")


def some_rows(seed: int, n: int, low_m: float = 5.0, high_m: float = 10.0) -> FloatArray:
    rng = np.random.default_rng(seed)
    return sampling.place(rng, sampling.ships(rng, n, DOMAIN), low_m, high_m)


def paper_rows(n: int) -> FloatArray:
    """The paper's ships: 75 x 25 m, 0.05 m/s, 0.01 rad, T = 600 s."""
    rng = np.random.default_rng(7)
    rows = sampling.ships(rng, n, DOMAIN)
    column = {name: i for i, name in enumerate(COLUMNS)}
    rows[:, column["speed_mps"]] = rng.uniform(0.5, 12.0, n)
    rows[:, column["age_s"]] = np.round(rng.uniform(0, 600, n), 6)
    fixed = {
        "until_age_s": 600.0, "speed_noise_mps": 0.05, "course_noise_rad": 0.01, "heading_error_rad": 0.01,
        "bow_m": 37.5, "stern_m": 37.5, "port_m": 12.5, "starboard_m": 12.5, "position_error_m": 0.0,
    }  # fmt: skip
    for name, value in fixed.items():
        rows[:, column[name]] = value
    rows[:, column["heading_rad"]] = rows[:, column["course_rad"]]
    return sampling.place(rng, rows, 5.0, 10.0)


def direction_error_deg(away: FloatArray, true_away: FloatArray) -> FloatArray:
    cross = away[:, 0] * true_away[:, 1] - away[:, 1] * true_away[:, 0]
    return np.asarray(np.degrees(np.abs(np.arctan2(cross, (away * true_away).sum(axis=1)))))


@pytest.mark.parametrize(("low_m", "high_m"), [(5.0, 10.0), (-30.0, 5.0), (0.0, 5000.0)])
def test_the_network_never_claims_more_distance_than_there_is(low_m: float, high_m: float) -> None:
    rows = some_rows(1, 8_000, low_m, high_m)
    distance, _, _ = NETWORK.run(rows)
    true_distance, _ = sampling.exact(rows)
    assert (distance <= true_distance).all()


def test_at_five_to_ten_metres_the_distance_is_within_a_decimetre() -> None:
    rows = some_rows(2, 8_000)
    under = sampling.exact(rows)[0] - NETWORK.run(rows)[0]
    assert np.percentile(under, 50) < 0.02
    assert under.max() < 0.1


def test_the_soundness_run_finds_no_unsafe_point_and_would_find_one() -> None:
    assert soundness.run("straight", 6_000, seed=5).unsafe == 0
    assert soundness.run("paper15x16", 6_000, seed=5).unsafe > 0


@pytest.mark.parametrize(("fastest_mps", "longest_s", "most"), [(12.0, 600.0, 0.06), (20.0, 1200.0, 0.15)])
def test_over_the_whole_domain_direction_and_force_are_the_exact_ones(
    fastest_mps: float, longest_s: float, most: float
) -> None:
    lengths = dict.fromkeys(("age_s", "until_age_s"), (0.0, longest_s))
    rng = np.random.default_rng(11)
    ships = sampling.ships(rng, 20_000, DOMAIN | lengths | {"speed_mps": (0.5, fastest_mps)})
    rows = sampling.place(rng, ships, 5.0, 10.0)
    _, away, velocity = NETWORK.run(rows)
    true_distance, true_away = sampling.exact(rows)
    strength = repulsion_strength(true_distance, CONFIG.field.k_r, CONFIG.field.delta_m)
    turned = direction_error_deg(away, true_away)
    relative = np.abs(np.hypot(*velocity.T) / strength - 1)
    assert np.percentile(turned, 99) <= 0.1
    assert turned.max() <= 3.0
    assert np.percentile(relative, 99) <= most / 2
    assert relative.max() <= most


def test_for_the_papers_ships_direction_and_force_are_the_exact_fields() -> None:
    rows = paper_rows(8_000)
    distance, away, velocity = NETWORK.run(rows)
    true_distance, true_away = sampling.exact(rows)
    turned = direction_error_deg(away, true_away)
    strength = repulsion_strength(true_distance, CONFIG.field.k_r, CONFIG.field.delta_m)
    relative = np.abs(np.hypot(*velocity.T) / strength - 1)
    assert (distance <= true_distance).all()
    assert np.percentile(turned, 99) <= 1.5
    assert turned.max() <= 3.0
    assert np.percentile(relative, 99) <= 0.06
    assert relative.max() <= 0.10


@settings(max_examples=100, deadline=None)
@given(
    corner=st.lists(st.booleans(), min_size=len(COLUMNS), max_size=len(COLUMNS)),
    bearing=st.floats(-math.pi, math.pi),
    length=st.floats(0.0, 20_000.0).map(lambda metres: round(metres, 3)),
    heading_known=st.booleans(),
)
def test_at_every_corner_of_the_domain_it_stays_below_the_truth(
    corner: list[bool], bearing: float, length: float, heading_known: bool
) -> None:
    row = np.array([[DOMAIN[name][side] for name, side in zip(COLUMNS, corner, strict=True)]])
    row[0, :2] = length * math.cos(bearing), length * math.sin(bearing)
    row[0, COLUMNS.index("speed_noise_mps")] = min(row[0, 6], row[0, 3])
    row[0, UNTIL] = max(row[0, UNTIL], row[0, COLUMNS.index("age_s")])
    if not heading_known:
        row[0, COLUMNS.index("heading_error_rad")] = math.pi
        row[0, COLUMNS.index("position_error_m")] = min(row[0, COLUMNS.index("position_error_m")], 200.0)
        as_circles(row)
    assert NETWORK.in_range(row).all()
    distance, away, _ = NETWORK.run(row)
    assert distance[0] <= sampling.exact(row)[0][0]
    assert np.hypot(*away[0]) == pytest.approx(1.0, abs=1e-6)


def test_the_repulsion_points_away_from_every_point_of_the_set() -> None:
    rows = some_rows(3, 500, 0.1, 200.0)
    distance, away, velocity = NETWORK.run(rows)
    tracks = sampling.tracks_of(rows)
    support = np.array([
        reach.tube(tracks, sampling.NOW, rows[:, UNTIL]).support(a[None])[i, 0] for i, a in enumerate(away)
    ])  # fmt: skip
    # the vehicle is at the origin: all of the set lies behind the line at -distance
    outside = distance > 0.01
    assert (support[outside] <= -distance[outside] + 1e-9).all()
    assert ((velocity * away).sum(axis=1) > 0).all()


def distances(tracks: Tracks, rows: FloatArray, network: NetworkRepulsion) -> FloatArray:
    answer = network(tracks, sampling.NOW, rows[:, UNTIL], np.zeros(2))
    return answer.nearest.distance_m


def test_rows_out_of_range_are_answered_by_the_exact_field_and_marked() -> None:
    rows = some_rows(4, 9)
    tracks = sampling.tracks_of(rows)
    speed, noise, model = tracks.sog_mps.copy(), tracks.course_noise_rad.copy(), tracks.model.copy()
    validity = tracks.validity_s.copy()
    speed[0], noise[1], model[2], validity[3] = 30.0, 0.3, Model.DISC, -1.0
    tracks = replace(tracks, sog_mps=speed, course_noise_rad=noise, model=model, validity_s=validity)
    answer = NetworkRepulsion.load("straight", CONFIG)(tracks, sampling.NOW, rows[:, UNTIL], np.zeros(2))
    exact = ExactRepulsion(CONFIG.field)(tracks, sampling.NOW, rows[:, UNTIL], np.zeros(2))
    assert answer.from_network.tolist() == [False] * 4 + [True] * 5
    np.testing.assert_array_equal(answer.nearest.distance_m[:4], exact.nearest.distance_m[:4])
    np.testing.assert_array_equal(answer.velocity[:4], exact.velocity[:4])
    assert (answer.nearest.distance_m[4:] <= exact.nearest.distance_m[4:]).all()


def test_a_vehicle_where_a_direction_has_no_length_gets_no_false_claim() -> None:
    """Antenna at a corner of the hull or of no hull at all, the vehicle on the antenna or on a corner."""
    rows = np.zeros((8, len(COLUMNS)))
    rows[:, COLUMNS.index("speed_mps")] = np.repeat([0.0, 5.0], 4)
    rows[:, UNTIL] = 600.0
    rows[[1, 2, 5, 6], COLUMNS.index("bow_m")] = 300.0
    rows[[2, 6], COLUMNS.index("port_m")] = 40.0
    rows[:, COLUMNS.index("position_error_m")] = 50.0
    rows[[3, 7], 0] = rows[[3, 7], UNTIL] * rows[[3, 7], COLUMNS.index("speed_mps")]
    assert NETWORK.in_range(rows).all()
    distance, away, _ = NETWORK.run(rows)
    assert (distance <= sampling.exact(rows)[0]).all()
    np.testing.assert_allclose(np.hypot(*away.T), 1.0, atol=1e-6)


def test_a_hull_of_unknown_heading_is_answered_as_its_circle() -> None:
    rows = some_rows(12, 40)
    tracks = sampling.tracks_of(rows)
    tracks = replace(tracks, heading_error_rad=np.full(40, math.pi), position_error_m=np.full(40, 20.0))
    answer = NetworkRepulsion.load("straight", CONFIG)(tracks, sampling.NOW, rows[:, UNTIL], np.zeros(2))
    exact = ExactRepulsion(CONFIG.field)(tracks, sampling.NOW, rows[:, UNTIL], np.zeros(2))
    assert answer.from_network.all()
    under = exact.nearest.distance_m - answer.nearest.distance_m
    asked = (exact.nearest.distance_m > 0) & (exact.nearest.distance_m < far_m(CONFIG.field))
    assert asked.sum() > 10
    assert (under >= 0).all()
    assert under[asked].max() < 0.1


def test_a_tube_that_ends_before_it_begins_is_out_of_range_as_a_row_and_at_its_age_as_a_track() -> None:
    rows = some_rows(5, 2)
    tracks = sampling.tracks_of(rows)
    early = rows[:, COLUMNS.index("age_s")] - 1.0
    filled = ContactRows().fill(tracks, sampling.NOW, early, np.zeros(2))
    np.testing.assert_array_equal(filled[:, UNTIL], tracks.age_s(sampling.NOW))
    rows[:, COLUMNS.index("age_s")] = 10.0
    rows[:, UNTIL] = [9.0, 10.0]
    assert NETWORK.in_range(rows).tolist() == [False, True]


def test_a_ship_slower_than_its_noise_is_out_of_range() -> None:
    rows = some_rows(5, 1)
    rows[0, COLUMNS.index("speed_mps")] = 0.1
    rows[0, COLUMNS.index("speed_noise_mps")] = 0.2
    assert not NETWORK.in_range(rows).any()


@pytest.mark.parametrize("column", range(len(COLUMNS)))
def test_a_value_that_is_not_a_number_is_out_of_range(column: int) -> None:
    rows = some_rows(5, 3)
    rows[1, column] = math.nan
    assert NETWORK.in_range(rows).tolist() == [True, False, True]


def test_an_empty_picture_gives_an_empty_answer() -> None:
    answer = NETWORK(Tracks.empty(), sampling.NOW, np.empty(0), np.zeros(2))
    assert answer.velocity.shape == (0, 2)


def test_the_same_rows_give_the_same_bits() -> None:
    rows = some_rows(6, 50)
    first, again = NETWORK.run(rows), NetworkRepulsion.load("straight", CONFIG).run(rows.copy())
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_rows_answer_hardly_depends_on_its_neighbours() -> None:
    rows = some_rows(7, 64)
    order = np.random.default_rng(0).permutation(64)
    whole = NETWORK.run(rows)
    shuffled = NETWORK.run(rows[order])
    alone = [NETWORK.run(rows[i : i + 1]) for i in range(64)]
    # onnxruntime may sum in another order for another batch: float32, far below the margin
    np.testing.assert_allclose(shuffled[0], whole[0][order], atol=5e-3, rtol=0)
    np.testing.assert_allclose([a[0][0] for a in alone], whole[0], atol=5e-3, rtol=0)


def test_inside_the_set_it_pushes_outward_with_the_saturated_force() -> None:
    rows = some_rows(8, 2000, -30.0, -1.0)
    distance, away, velocity = NETWORK.run(rows)
    inside = distance < 0
    assert inside.sum() > 1000
    np.testing.assert_allclose(velocity[inside], CONFIG.field.k_r * away[inside], rtol=1e-6)


def test_what_only_a_report_changes_is_refreshed_with_new_tracks() -> None:
    rows = some_rows(9, 4)
    network = NetworkRepulsion.load("straight", CONFIG)
    tracks = sampling.tracks_of(rows)
    before = distances(tracks, rows, network)
    grown = replace(tracks, position_error_m=tracks.position_error_m * 0.5)
    after_report = distances(grown, rows, network)
    assert (after_report >= before).all()
    later = after(sampling.NOW, 1.0)
    moved = network(grown, later, rows[:, UNTIL] + 1.0, np.array([3.0, 0.0])).nearest.distance_m
    assert not np.allclose(moved, after_report)


# ---------------------------------------------------------------- start-up


def test_the_metadata_say_what_the_network_is() -> None:
    metadata = NETWORK.metadata
    assert metadata.conservative
    assert (metadata.delta_m, metadata.k_r) == (CONFIG.field.delta_m, CONFIG.field.k_r)
    assert metadata.error["unsafe_points"] == 0
    assert {i.unit for i in metadata.inputs} == {"m", "rad", "m/s", "s"}
    assert len(NETWORK.digest) == 64


def test_every_default_of_the_configuration_and_the_papers_values_are_inside() -> None:
    for noise, course in ((CONFIG.contacts.speed_noise_mps, CONFIG.contacts.course_noise_rad), (0.05, 0.01)):
        contacts = msgspec.structs.replace(CONFIG.contacts, speed_noise_mps=noise, course_noise_rad=course)
        NetworkRepulsion.load("straight", msgspec.structs.replace(CONFIG, contacts=contacts))
    assert DOMAIN["heading_error_rad"][1] >= (
        CONFIG.contacts.heading_error_rad + CONFIG.contacts.course_noise_rad
    )


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("field", "delta_m", 6.0),
        ("field", "k_r", 10.0),
        ("field", "horizon_s", 5000.0),
        ("contacts", "course_noise_rad", 0.4),
        ("contacts", "speed_noise_mps", 9.0),
    ],
)
def test_a_configuration_the_model_was_not_trained_for_is_refused(
    section: str, key: str, value: float
) -> None:
    other = config.from_mapping({"goal": {"latitude_deg": 54.0, "longitude_deg": 8.0}, section: {key: value}})
    with pytest.raises(ModelError, match=rf"{section}\.{key} = .*straight.*train"):
        NetworkRepulsion.load("straight", other)


def test_a_model_that_is_not_there_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(ModelError, match=r"no such file or packaged model.*straight"):
        NetworkRepulsion.load("crooked", CONFIG)


def test_a_file_that_is_not_a_network_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "noise.onnx"
    path.write_bytes(bytes(range(256)) * 20)
    with pytest.raises(ModelError, match="onnxruntime cannot read it"):
        NetworkRepulsion.load(path, CONFIG)


def test_a_truncated_model_is_refused(tmp_path: Path) -> None:
    content = model_file.read_bytes("straight")[1]
    path = tmp_path / "half.onnx"
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(ModelError):
        NetworkRepulsion.load(path, CONFIG)


def test_a_network_without_our_metadata_is_refused(tmp_path: Path) -> None:
    content = model_file.read_bytes("straight")[1]
    path = tmp_path / "foreign.onnx"
    # the same length, another key: still valid protobuf
    path.write_bytes(content.replace(b"\x0a\x09companion\x12", b"\x0a\x09stranger_\x12"))
    with pytest.raises(ModelError, match="without our metadata"):
        NetworkRepulsion.load(path, CONFIG)


def test_metadata_of_another_schema_or_shape_are_refused() -> None:
    metadata = NETWORK.metadata
    newer = msgspec.structs.replace(metadata, schema=99)
    fewer = msgspec.structs.replace(metadata, inputs=metadata.inputs[:-1])
    with pytest.raises(ModelError, match="schema 99"):
        model_file.decode_metadata(newer.encode(), "x")
    with pytest.raises(ModelError, match="input columns"):
        model_file.decode_metadata(fewer.encode(), "x")
    with pytest.raises(ModelError, match="unreadable metadata"):
        model_file.decode_metadata("{}", "x")


def test_the_session_takes_any_number_of_contacts() -> None:
    session = open_session(model_file.read_bytes("straight")[1], "straight")
    for n in (1, 3, 200):
        assert session.run(OUTPUTS, {INPUT: some_rows(n, n)})[0].shape == (n,)
