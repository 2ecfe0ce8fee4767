"""The guard's two cheap proofs, free water around and nearness to a verified path, against the full check."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion import reach
from companion.config import Config
from companion.instant import Instant, after, instant
from companion.messages import Model, OwnState, Tracks
from companion.planning.guard import Guard, Velocity
from companion.planning.guard.berth import AHEAD_S, WIDEST_M, Berth, to_stop_m
from companion.planning.guard.beside import MOST_M, Beside
from companion.planning.guard.clearance import Clearance
from companion.planning.guard.margins import Margins
from companion.planning.guard.way_out import WayOut
from companion.reach import Slices
from sitl.studies.hostile import intending
from sitl.vehicle import Demand, KinematicSubmarine, Limits
from tests.builders import T0, config, heartbeat, own, tracks
from tests.ships import random_ships

SETTINGS = config()


def scene(rng: np.random.Generator, n: int = 10) -> Tracks:
    """Ships of every model around the vehicle, some of whose bounds end soon."""
    spread = np.cumsum(rng.uniform(0, 40, (n, 4, 3)), axis=1)
    return replace(
        random_ships(
            rng,
            n,
            north_m=rng.uniform(-1500, 1500, n),
            east_m=rng.uniform(-1500, 1500, n),
            bow_m=rng.uniform(5, 60, n),
            stern_m=rng.uniform(5, 60, n),
            measured_at_ns=(-1e9 * rng.uniform(0, 60, n)).astype(np.int64),
            validity_s=rng.choice((95.0, 130.0, 300.0, 600.0), n, p=(0.1, 0.1, 0.4, 0.4)),
            model=rng.choice(list(Model), n, p=(0.5, 0.1, 0.1, 0.15, 0.15)).astype(np.int64),
            disc_speed_mps=rng.uniform(0, 1, n),
            speed_noise_mps=np.full(n, 0.1),
            course_noise_rad=np.full(n, 0.02),
            turn_rate_radps=rng.uniform(-1e-3, 1e-3, n),
            top_speed_mps=np.full(n, 16.0),
        ),
        spread_m=spread,
    )


def is_clear(way_out: WayOut, slices: Slices, clearance: Clearance) -> bool:
    """The same by the exact sets, ten times a second."""
    tracks, margins = slices.tracks, Margins.of(SETTINGS, 0.0)
    for t in np.arange(0.0, way_out.t_s[-1], 0.1):
        now = after(way_out.begin, float(t))
        room = reach.at(tracks, now).nearest(np.array(way_out.position_m(now))).distance_m - margins.at(t)
        if room[tracks.age_s(now) <= clearance.until_s].min(initial=np.inf) <= 0:
            return False
    end = after(way_out.begin, float(way_out.t_s[-1]))
    room = reach.tube(tracks, end, clearance.until_s).nearest(np.array(way_out.end_m)).distance_m
    room -= margins.tracking_m + margins.localised(clearance.until_s - tracks.age_s(way_out.begin))
    return bool(room[tracks.age_s(end) < clearance.until_s].min(initial=np.inf) > 0)


class Checked(Guard):
    """Looks in full at everything that passes without a full look."""

    free = beside = courses = 0

    def _lies_free(self, now: Instant, own: OwnState, slices: Slices) -> bool:
        free = super()._lies_free(now, own, slices)
        if free and self.wanted is not None:
            self.free += 1
            self.look(now, own, slices, self._stop(now, own, self.wanted, self._sent))
        return free

    def _stays_beside(self, now: Instant, own: OwnState, wanted: Velocity) -> bool:
        beside = super()._stays_beside(now, own, wanted)
        if beside:
            self.beside += 1
            assert self._way_out is not None
            assert self._slices is not None
            self.courses += self._way_out.orders is not None
            self.look(now, own, self._slices, self._way_out)
        return beside

    def look(self, now: Instant, own: OwnState, slices: Slices, way_out: WayOut) -> None:
        clearance = self._clearance(now, own, 0.0, slices)
        assert not clearance.unknown.any()
        # the full check bounds from below, loosely where a ship's bounds end: then every instant is looked at
        assert self._search.is_clear(way_out, now, clearance) or is_clear(way_out, slices, clearance)

    wanted: Velocity | None = None


def moved(rng: np.random.Generator, ships: Tracks) -> Tracks:
    """The next picture: each ship where it was, or nearly, or somewhere else."""
    far, n = rng.choice((0.0, 1.0, 300.0)), len(ships)
    north, east = (place + far * rng.normal(0, 1, n) for place in (ships.north_m, ships.east_m))
    return replace(ships, revision=2, north_m=north, east_m=east)


def fly(seed: int, settings: Config, seconds: int = 40, *, intends: bool = False) -> Checked:
    """A wandering planner among random ships; twice a second, and one new report on the way."""
    rng = np.random.default_rng(seed)
    course = intending(rng, 2.5) if intends else None
    ships, guard, hull = scene(rng), Checked(settings), KinematicSubmarine(Limits())
    state = hull.start(0.0, 0.0, 45.0, rng.uniform(-3, 3))
    wanted = (0.0, 0.0, 0.0)
    for step in range(2 * seconds):
        now = instant(0.5 * step)
        if rng.random() < 0.1:
            angle = rng.uniform(-math.pi, math.pi)
            wanted = (2.5 * math.cos(angle), 2.5 * math.sin(angle), 0.0)
        here = OwnState(now, state.north_m, state.east_m, 45.0, state.velocity_ned_mps, state.heading_rad)
        said = None if step and rng.random() < 0.2 else wanted
        if step == seconds:
            ships = moved(rng, ships)
            said = None if rng.random() < 0.5 else wanted
        guard.wanted = said
        told = None if course is None else course(now, here)
        verdict = guard.check(now, here, heartbeat(0.5 * step), ships, 1, said, told)
        assert verdict.velocity_ned_mps is not None
        for _ in range(5):
            state = hull.step(state, Demand(verdict.velocity_ned_mps), 0.1)
    return guard


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_what_passes_on_a_shortcut_also_passes_the_full_check(seed: int, intends: bool) -> None:
    fly(seed, config(timing={"rate_hz": 2.0, "setpoint_validity_s": 1.0}), intends=intends)


def test_both_shortcuts_are_taken() -> None:
    flown = [fly(seed, config(timing={"rate_hz": 2.0, "setpoint_validity_s": 1.0})) for seed in range(6)]
    assert sum(guard.free for guard in flown) > 50
    assert sum(guard.beside for guard in flown) > 50
    assert sum(guard.courses for guard in flown) == 0


def test_a_course_is_kept_on_the_shortcut_too() -> None:
    settings = config(timing={"rate_hz": 2.0, "setpoint_validity_s": 1.0})
    assert sum(fly(seed, settings, intends=True).courses for seed in range(6)) > 10


def berth_of(ships: Tracks, now: Instant = T0) -> Berth:
    return Berth.around(own(), Slices.of(ships), now, Margins.of(SETTINGS, 0.0), SETTINGS)


def test_a_berth_reaches_to_where_the_nearest_tube_begins_and_no_farther_than_is_looked_for() -> None:
    still = {"sog_mps": 0.0, "speed_noise_mps": 0.0, "cog_rad": 0.0}
    margin = 5.0 + 2.0 + 8.0 + 0.003 * 600
    berth = berth_of(tracks({**still, "north_m": 100.0 + 37.5}))
    assert berth.radius_m == pytest.approx(100.0 - margin, abs=0.3)  # the hull may be turned a little
    assert berth_of(tracks({**still, "north_m": 9000.0})).radius_m == WIDEST_M
    assert berth_of(tracks({**still, "north_m": 0.0})).radius_m < 0


def test_a_berth_holds_for_its_time_and_asks_again_when_that_can_help() -> None:
    berth = Berth(0.0, 0.0, 20.0, instant(10.0))
    assert berth.holds(instant(10.0), own(5.0), 14.9)
    assert not berth.holds(instant(10.0), own(5.0), 15.0)
    assert not berth.holds(instant(10.1), own(5.0), 1.0)
    assert berth.may_be_better(instant(10.1), own(), 1.0)
    assert not berth.may_be_better(instant(5.0), own(1.9), 15.0)
    assert berth.may_be_better(instant(5.0), own(2.0), 15.0)
    assert not berth.may_be_better(instant(5.0), own(9.9), 30.0)
    assert berth.may_be_better(instant(5.0), own(10.0), 30.0)


def test_where_unknown_water_may_be_there_is_no_berth() -> None:
    ship = tracks({"measured_at_s": -590.0, "validity_s": 600.0, "north_m": -3300.0})
    assert berth_of(ship).radius_m < 0
    assert berth_of(ship).until == after(T0, AHEAD_S)


@given(
    st.floats(0.0, 4.0), st.floats(-3.2, 3.2), st.floats(-3.2, 3.2), st.floats(0.0, 2.5), st.floats(0.0, 1.0)
)
def test_the_way_to_stop_is_never_longer_than_said(
    moving: float, course: float, heading: float, told: float, late_s: float
) -> None:
    state = replace(
        own(),
        velocity_ned_mps=(moving * math.cos(course), moving * math.sin(course), 0.0),
        heading_rad=heading,
    )
    now = instant(late_s)
    guard = Guard(SETTINGS)
    sent = (told, 0.0, 0.0)
    way_out = guard._stop(now, state, (0.0, told, 0.0), sent)
    assert np.hypot(way_out.north_m, way_out.east_m).max() <= to_stop_m(now, state, SETTINGS)


def straight(begin_s: float, aside_m: float, *, speed: float = 2.0, end_s: float = 20.0) -> WayOut:
    """North at `speed`, from where 2 m/s would be at `begin_s`."""
    t = np.linspace(0.0, end_s, 6)
    north = 2.0 * begin_s + speed * t
    return WayOut(instant(begin_s), t, north, np.full(6, aside_m), (speed, 0.0), end_s, verified=True)


@pytest.mark.parametrize(
    ("other", "covered"),
    [
        (straight(0.0, 0.0), True),
        (straight(5.0, 4.9, end_s=15.0), True),
        (straight(5.0, 5.0, end_s=15.0), False),  # as far aside as there is room
        (straight(5.0, 0.0, end_s=17.4), True),  # stops 4.8 m behind
        (straight(5.0, 0.0, end_s=17.6), False),
        (straight(5.0, 0.0, speed=1.7, end_s=15.0), True),  # 4.5 m short
        (straight(5.0, 0.0, speed=1.6, end_s=15.0), False),
        (straight(10.1, 0.0, end_s=9.0), False),  # later than anything is known
        (straight(10.0, 0.0, end_s=9.0), True),
    ],
)
def test_a_path_is_covered_as_long_as_it_is_nearer_than_there_is_room(other: WayOut, covered: bool) -> None:
    beside = Beside.of(straight(0.0, 0.0), np.full(6, 5.0), instant(10.0))
    assert beside.covers(other) is covered


def test_room_counts_from_each_point_to_the_next() -> None:
    for k in range(6):
        room = np.full(6, np.inf)
        room[k] = 1.0
        beside = Beside.of(straight(0.0, 0.0), room, instant(30.0))
        assert not beside.covers(straight(0.0, 2.0))
        assert Beside.of(straight(0.0, 0.0), np.full(6, np.inf), instant(30.0)).covers(
            straight(0.0, MOST_M - 1)
        )
    # a corner of the other between two points of the first
    t = np.array((0.0, 5.0, 6.0, 7.0, 20.0))
    corner = WayOut(T0, t, 2.0 * t, np.array((0.0, 0.0, 4.0, 0.0, 0.0)), (2.0, 0.0), 20.0, verified=True)
    room = np.array((9.0, 9.0, 3.0, 9.0, 9.0, 9.0))
    assert not Beside.of(straight(0.0, 0.0), room, instant(30.0)).covers(corner)
    assert Beside.of(straight(0.0, 0.0), np.roll(room, 2), instant(30.0)).covers(corner)


def test_a_path_that_has_ended_covers_nothing() -> None:
    beside = Beside.of(straight(0.0, 0.0), np.full(6, 5.0), instant(100.0))
    assert not beside.covers(straight(20.0, 0.0))
