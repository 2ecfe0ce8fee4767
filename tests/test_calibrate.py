"""Bounds learned from recorded traffic: what they promise is measured on ships never used."""

import argparse
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from companion import config
from companion.calibrate import bounds_file, command, conformal
from companion.calibrate.conformal import calibrate, of_others, quantile
from companion.calibrate.dataset import Dataset, collect
from companion.calibrate.evaluate import figures, forgetting
from companion.calibrate.fit import MEAN_AREA, Scales, Shape, area_m2, fit, sides_m
from companion.calibrate.transfer import foretold, is_at_rest, replayed, wilson
from companion.edges import traffic
from companion.errors import ConfigError, LogError
from companion.instant import instant
from companion.messages import SPREAD_AGES_S, FloatArray, Model
from companion.picture import Picture, learned
from companion.picture.adaptation import MOST_SHIPS, SHIP_RATE, Adaptation
from companion.picture.behaviour import FEATURES, Fix
from companion.picture.forecast import Forecast, Outcome
from tests.contact_reports import picture, report, tracks

HOUSTON = "ais_houston_ship_channel_20200101_1500-1700Z.csv.gz"
GULF = "n2k_gulf_of_finland_20140815_refragmented.candump.gz"
LEVEL = 0.95


@pytest.fixture(scope="module")
def houston(shared_data: Path) -> Dataset:
    return collect(traffic.read(shared_data / HOUSTON, Counter()))


def test_the_table_s_straight_errors_are_those_known_of_this_water(houston: Dataset) -> None:
    """Median 10, 21, 69, 261 m and 95th percentile 108, 322, 928, 3219 m were measured by others."""
    strayed = [np.hypot(houston.at(k).ahead_m, houston.at(k).aside_m) for k in range(4)]
    assert [np.median(s) for s in strayed] == pytest.approx([10, 21, 69, 261], rel=0.2)
    assert [np.quantile(s, 0.95) for s in strayed] == pytest.approx([108, 322, 928, 3219], rel=0.2)


def test_unseen_vessels_are_covered_within_half_the_area_of_the_best_disc(houston: Dataset) -> None:
    """One deal here; `companion calibrate` makes four, and `tests.benchmarks.bench_bounds` many more."""
    found = figures(houston, "kite", (0.95, 0.99), 4, np.random.default_rng(1))
    assert [f.age_s for f in found if f.level == LEVEL] == list(SPREAD_AGES_S)
    for f in found:
        assert abs(f.coverage - f.level) < 0.02
        assert f.outcomes == len(houston.at(SPREAD_AGES_S.index(f.age_s)))  # each vessel was unseen once
        assert max(f.ratio, f.ratio_to_level) < 0.55


def test_no_vessel_is_scored_by_scales_it_helped_to_fit(
    houston: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitted: list[set[int]] = []
    scored: list[tuple[set[int], set[int]]] = []

    class Spy(Scales):
        def score(self, data: Dataset, k: int) -> FloatArray:
            scored.append((set(data.vessel.tolist()), fitted[-1]))
            return super().score(data, k)

    def fit(data: Dataset, shape: Shape) -> Spy:
        fitted.append(set(data.vessel.tolist()))
        nothing = np.zeros((3, len(FEATURES)))
        return Spy(nothing[0], nothing[0] + 1, nothing, nothing, np.zeros((3, 4)), shape)

    monkeypatch.setattr(conformal, "fit", fit)
    calibrate(houston, "kite", np.random.default_rng(3))
    assert len(scored) == 2 * 4 * conformal.FOLDS
    assert all(not seen & used for seen, used in scored)
    assert set().union(*(seen for seen, _ in scored)) == set(houston.vessel[houston.under_way].tolist())


def test_the_quantile_is_that_of_split_conformal_prediction() -> None:
    assert quantile(np.arange(1.0, 100.0), 0.95) == 95.0
    assert quantile(np.arange(1.0, 20.0), 0.95) == 19.0
    assert quantile(np.arange(1.0, 19.0), 0.95) == np.inf


def test_the_rank_is_that_by_which_every_vessel_is_covered_by_the_others() -> None:
    """Against counting: the least quantile whose rank, over the others' values, holds the level."""
    rng = np.random.default_rng(0)
    vessels = rng.integers(0, 30, 600)
    values = 1.5 * rng.normal(size=30)[vessels] + rng.normal(size=600)
    for level in (0.9, LEVEL):
        found = of_others(values, vessels, level)
        assert found > quantile(values, level)  # vessels differ: the plain one would hold too few
        shares = [
            np.concatenate([values[vessels == v] <= quantile(values[vessels != v], rank) for v in range(30)])
            for rank in (float(np.mean(values <= found)), float(np.mean(values <= found)) - 0.004)
        ]
        assert shares[0].mean() >= level > shares[1].mean()


def test_fits_on_different_vessels_have_the_same_mean_area(houston: Dataset) -> None:
    for third in (0, 1):
        data = houston.only(houston.vessel % 3 == third)
        scales = fit(data, "kite")
        for k, age_s in enumerate(SPREAD_AGES_S):
            sizes = np.exp(scales.log(data.around(k).features, k)).T
            assert area_m2(sizes, "kite").mean() == pytest.approx(MEAN_AREA * age_s**2)


def test_the_file_says_what_the_fit_says(houston: Dataset, tmp_path: Path) -> None:
    """Scores and sizes by the runtime's reader against those of the calibration."""
    data = houston.only(houston.under_way & (houston.vessel % 3 == 0))
    found = calibrate(data, "kite", np.random.default_rng(0))
    path = tmp_path / "some.bounds.toml"
    path.write_text(bounds_file.text(found, houston, (0.95, 0.99), ["here"]))
    bounds = learned.load(str(path), LEVEL)
    part = data.at(1)
    scores, half = found.scales.score(part, 1), found.scales.half_m(part, 1, found.quantile(1, LEVEL))
    for i in range(0, len(part), 25):
        seen = Forecast(Fix(instant(0.0), 29.0, -94.0, part.sog_mps[i], 0.0), tuple(part.features[i]), 3)
        outcome = Outcome(1, instant(60.0), seen, 1, part.age_s[i], part.ahead_m[i], part.aside_m[i])
        (score,) = bounds.scores([outcome])
        assert score == pytest.approx(scores[i] - found.quantile(1, LEVEL), abs=1e-3) or not np.isfinite(
            scores[i]
        )
        speed = part.sog_mps[i : i + 1]
        (size,) = bounds.spread_m(
            bounds.log_scale(part.features[i : i + 1]),
            np.zeros((1, 4)),
            speed,
            np.maximum(16.0, speed + 0.25),
        )
        assert (size[1] >= half[i] * 0.999).all()  # only ever larger: sizes never shrink with age
    assert sides_m(part, 1).shape == (3, len(part))


def test_forgetting_misplaces_most_ships_within_two_minutes(houston: Dataset) -> None:
    rules = {(f.age_s, f.rule): f for f in forgetting(houston)}
    assert rules[120.0, "drop after 60 s"].misplaced == 1.0
    assert rules[120.0, "stop after 30 s"].misplaced > 0.8
    assert rules[120.0, "freeze in place"].misplaced > 0.9
    assert rules[120.0, "straight on"].misplaced < 0.2


def test_the_packaged_bounds_hold_on_another_water(shared_data: Path) -> None:
    """Houston's bounds on the Gulf of Finland: open water is easier."""
    bounds = learned.load("houston", LEVEL)
    outcomes = foretold(traffic.read(shared_data / GULF, Counter()))
    at_rest = replayed(bounds, outcomes, is_at_rest)
    assert all(row.fixed > LEVEL - 0.02 for row in at_rest if row.scored > 50)
    for row in replayed(bounds, outcomes):
        assert row.scored > 50
        assert row.fixed > LEVEL - 0.02


def test_adaptation_brings_coverage_back_within_two_points_in_half_an_hour() -> None:
    """A water where ships stray three times as far as in the file, 60 ships, two hours."""
    bounds = learned.load("houston", LEVEL)
    rng = np.random.default_rng(5)
    features = (0.0,) * len(FEATURES)
    half = bounds.spread_m(
        bounds.log_scale(np.array([features])), np.zeros((1, 4)), np.array([5.0]), np.array([16.0])
    )[0]
    outcomes = []
    for minute in range(120):
        for ship in range(60):
            fix = Fix(instant(60.0 * minute), 59.0, 24.0, 5.0, 0.0)
            for k, age_s in enumerate(SPREAD_AGES_S):
                # scores are exponential in the file's own units: 5 % beyond 1 before, 37 % now
                out = 3.0 * rng.exponential(1 / 3.0)
                seen = Forecast(fix, features, 3)
                at = instant(60.0 * minute + age_s)
                outcomes.append(Outcome(ship, at, seen, k, age_s, float(out * half[k, 0]), 0.0))
    for row in replayed(bounds, outcomes):
        assert row.fixed < 0.7
        assert row.adapted_late == pytest.approx(LEVEL, abs=0.02)


def test_bounds_of_the_open_sea_serve_a_harbour_after_half_an_hour(shared_data: Path, tmp_path: Path) -> None:
    """Learned in the Gulf of Finland, used among Houston's ferries and tows, none of which it has seen."""
    gulf = collect(traffic.read(shared_data / GULF, Counter()))
    path = tmp_path / "gulf.bounds.toml"
    found = calibrate(gulf, "kite", np.random.default_rng(0))
    path.write_text(bounds_file.text(found, gulf, (LEVEL,), ["gulf"]))
    bounds = learned.load(str(path), LEVEL)
    outcomes = foretold(traffic.read(shared_data / HOUSTON, Counter()))
    under_way, at_rest = replayed(bounds, outcomes), replayed(bounds, outcomes, is_at_rest)
    assert min(row.fixed for row in under_way) < LEVEL - 0.05
    for row in under_way:
        assert row.scored_late > 500
        assert row.adapted_late == pytest.approx(LEVEL, abs=0.02)
        assert row.by_sort_late["shuttle"] > 0.9
    # of ships at berth most do not move at all: their sets end at the smallest there are
    assert all(row.adapted_late > LEVEL - 0.02 for row in at_rest)


def test_a_ship_with_a_bounds_file_gets_a_set_that_follows_its_own_behaviour() -> None:
    """A steady ship's set is smaller than one's that turned a minute ago."""
    steady, turning = [], []
    for i in range(12):
        at = 60.0 * i
        steady.append(report(at, 5.0 * at, 0.0))
        course = 0.0 if i % 2 else 0.6
        turning.append(report(at, 5.0 * at, 100.0 * (i % 2), mmsi=230_000_002, cog_rad=course))
    reports = sorted(steady + turning, key=lambda r: r.received_at)
    heard = picture(*reports, bounds_file="houston")
    table = tracks(heard, 665.0)
    assert list(table.model) == [Model.KITE, Model.KITE]
    assert (table.spread_m[0] < 0.8 * table.spread_m[1]).all()
    assert (np.diff(table.spread_m, axis=1) >= 0).all()
    assert any(r.code == "note.coverage" for r in heard.notes(instant(665.0)))


def test_a_ship_that_left_her_sets_has_larger_ones_of_her_own_until_she_keeps_to_them() -> None:
    bounds = learned.load("houston", LEVEL)
    adaptation = Adaptation(bounds)
    fix = Fix(instant(0.0), 59.0, 24.0, 5.0, 0.0)
    seen = Forecast(fix, (0.0,) * len(FEATURES), 3)

    def happened(mmsi: int, strayed_m: float) -> None:
        adaptation.take(Outcome(mmsi, instant(60.0), seen, 0, 60.0, strayed_m, 0.0))

    def own(mmsi: int) -> FloatArray:
        larger: FloatArray = adaptation.raised_of([3], [mmsi])[0] - adaptation.raised[3]
        return larger

    happened(1, 5000.0)
    happened(2, 0.0)
    assert own(1)[0] == pytest.approx(SHIP_RATE * LEVEL)
    assert (own(1)[1:] == 0.0).all()  # what it said of one minute says nothing of ten
    assert (own(2) == 0.0).all()
    for _ in range(20):
        happened(1, 0.0)
    assert (own(1) == 0.0).all()


def test_what_is_kept_of_ships_that_left_their_sets_is_bounded() -> None:
    adaptation = Adaptation(learned.load("houston", LEVEL))
    seen = Forecast(Fix(instant(0.0), 59.0, 24.0, 5.0, 0.0), (0.0,) * len(FEATURES), 3)
    for mmsi in range(MOST_SHIPS + 10):
        adaptation.take(Outcome(mmsi, instant(60.0), seen, 0, 60.0, 1e9, 0.0))
    own = adaptation.raised_of([3] * 20, range(20)) - adaptation.raised[3]
    assert (own[:10] == 0.0).all()
    assert (own[10:, 0] > 0.0).all()


def test_a_small_number_of_outcomes_says_how_little_it_knows() -> None:
    assert wilson(0.95, 20) == pytest.approx((0.764, 0.991), abs=0.001)
    assert np.isnan(wilson(float("nan"), 0)).all()


def test_a_report_outside_its_set_is_an_event_with_its_reason() -> None:
    reports = [report(60.0 * i, 300.0 * i, 0.0) for i in range(8)]
    reports.append(report(480.0, 1800.0, 500.0, cog_rad=1.6))
    heard = picture(*reports, bounds_file="houston")
    events = [r for r in heard.notes(instant(481.0)) if r.code == "note.outside_set"]
    assert len(events) == 1
    assert "230000001 left its set" in events[0].text
    assert "500 m to starboard" in events[0].text


@pytest.mark.parametrize(
    ("name", "level", "words"),
    [
        ("nowhere", 0.95, "companion calibrate"),
        ("houston", 0.5, "states 0.9, 0.95, 0.99"),
    ],
)
def test_a_bounds_file_that_cannot_serve_is_refused_with_the_remedy(
    name: str, level: float, words: str
) -> None:
    with pytest.raises(ConfigError, match=words):
        Picture(config.Contacts(bounds_file=name, bounds_level=level))


def test_a_file_that_is_no_traffic_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "letter.txt"
    path.write_text("Dear sir")
    with pytest.raises(LogError, match="neither a table"):
        traffic.read(path, Counter())


def test_the_command_writes_bounds_report_and_picture(
    shared_data: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The Gulf of Finland alone: 44 vessels under way for ten minutes."""
    monkeypatch.setattr(command, "QUICK_SPLITS", 1)
    options = argparse.Namespace(
        traffic=[shared_data / GULF],
        out=str(tmp_path),
        name="gulf",
        splits=1,
        seed=1,
        check=[shared_data / GULF],
    )
    assert command.run(options) == 0
    page = (tmp_path / "gulf.bounds.md").read_text()
    assert "What forgetting costs" in page
    assert "Shorter than half an hour: what comes after it cannot be shown." in page
    assert "| under way, 1 min |" in page
    assert (tmp_path / "gulf.bounds.png").stat().st_size > 20_000
    assert learned.load(str(tmp_path / "gulf.bounds.toml"), LEVEL).level == LEVEL
    assert "vessels under way" in capsys.readouterr().out
