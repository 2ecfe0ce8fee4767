"""Measuring a run: the smallest distances are found, and blamed when they are too small."""

import io
import math
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from shapely import affinity, box
from shapely.geometry import Point

from companion import reach
from companion.instant import Instant, instant
from companion.messages import (
    Decision,
    FloatArray,
    Hull,
    Nearest,
    OwnState,
    Phase,
    Reason,
    Repulsion,
    Setpoint,
    Status,
    Tracks,
)
from sitl.closest import search, to_hulls
from sitl.measure import Measure
from sitl.truth import hull_array, true_tracks

HULL = Hull(60.0, 15.0, 12.5, 12.5)
SPEED_MPS = 5.0


def ship_at(t: Instant) -> Tracks:
    """One ship sailing north along east = 100 m, abeam of the origin at 60 s."""
    north_m = SPEED_MPS * (t * 1e-9 - 60.0)
    return true_tracks(
        t,
        mmsi=np.array([230_000_001]),
        position_m=np.array([[north_m, 100.0]]),
        course_rad=np.zeros(1),
        speed_mps=np.array([SPEED_MPS]),
        hulls=hull_array([HULL]),
        names=("NORTHBOUND",),
    )


def heard_at(t: Instant, **bounds: float) -> Tracks:
    """What a report of that moment says, with bounds."""
    columns: dict[str, Any] = {name: np.array([value]) for name, value in bounds.items()}
    return replace(ship_at(t), revision=1, **columns)


def decision(t: Instant, tracks: Tracks, **changes: Any) -> Decision:
    plain = Decision(
        t=t,
        phase=Phase.CROSS,
        status=Status.OK,
        reasons=(),
        own=None,
        tracks=tracks,
        repulsion=None,
        attraction_mps=None,
        wanted_ned_mps=None,
        setpoint=None,
        guard_changed=False,
        outgoing=(),
    )
    return replace(plain, **changes)


def still_vehicle(east_m: float, seconds: float = 90.0, depth_m: float = 45.0, **changes: Any) -> Measure:
    """A vehicle that stays at (0, east_m) while the ship passes."""
    own = OwnState(Instant(0), 0.0, east_m, depth_m, (0.0, 0.0, 0.0), None)
    measure = Measure(ship_at, lambda: own, delta_m=5.0)
    tracks = heard_at(instant(0), speed_noise_mps=0.05, validity_s=600.0)
    for k in range(round(seconds * 10)):
        t = instant(k / 10)
        measure.timed(t, 0.001 * (1 + (k == 7)))
        measure.decided(decision(t, tracks, **changes))
    return measure


def test_the_closest_hull_is_found_with_its_time_and_depth() -> None:
    measure = still_vehicle(0.0)
    closest = measure.summary(measure.course()).closest_hull
    assert closest is not None
    assert closest.distance_m == pytest.approx(100.0 - HULL.port_m)
    # abeam from when the bow arrives until the stern has gone
    assert 60.0 - 60.0 / SPEED_MPS - 0.11 <= closest.at * 1e-9 <= 60.0 + 15.0 / SPEED_MPS + 0.11
    assert (closest.mmsi, closest.name) == (230_000_001, "NORTHBOUND")
    assert (closest.depth_m, closest.vertical_clearance_m) == (45.0, 37.0)


def test_the_set_is_nearer_than_the_hull_and_as_near_as_at_every_step() -> None:
    measure = still_vehicle(0.0)
    course = measure.course()
    summary = measure.summary(course)
    every = [
        reach.at(course.tracks[k], course.instant(k)).nearest(np.zeros(2)).distance_m.min()
        for k in range(len(course))
    ]
    assert summary.closest_set is not None
    assert summary.closest_hull is not None
    assert summary.closest_set.distance_m == min(every)
    assert summary.closest_set.distance_m < summary.closest_hull.distance_m + 1e-9
    assert len(course.to_sets.step) < len(course) / 2  # and most steps were never computed


def test_the_companions_origin_moves_its_sets_and_not_the_hulls() -> None:
    measure = still_vehicle(0.0)
    shifted = measure.summary(measure.course(np.array((0.0, 10.0))))
    plain = measure.summary(measure.course())
    assert shifted.closest_hull == plain.closest_hull
    assert shifted.closest_set is not None
    assert plain.closest_set is not None
    assert shifted.closest_set.distance_m == pytest.approx(plain.closest_set.distance_m + 10.0)


def test_a_run_within_delta_of_a_set_is_blamed_by_name() -> None:
    measure = still_vehicle(85.0, phase=Phase.ARRIVED)
    summary = measure.summary(measure.course())
    assert summary.arrived
    (sentence,) = summary.failures
    assert "came within 2.5 m of a reachable set (NORTHBOUND" in sentence
    assert 10.0 < summary.within_delta_s < 20.0
    beside = still_vehicle(80.0, phase=Phase.ARRIVED)
    assert beside.summary(beside.course()).failures == ()


def test_a_run_that_did_not_arrive_is_blamed_with_its_reason() -> None:
    measure = still_vehicle(0.0, reasons=(Reason("plan.goal_occupied", "a ship can be at the goal"),))
    summary = measure.summary(measure.course())
    assert summary.failures == ("did not arrive: after 90 s the phase was cross: a ship can be at the goal",)
    assert summary.time_to_goal_s is None
    assert summary.reason_s == {"plan.goal_occupied": pytest.approx(89.9)}


def test_without_any_ship_nothing_is_close_and_nothing_is_invented() -> None:
    own = OwnState(Instant(0), 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), None)
    measure = Measure(lambda t: Tracks.empty(), lambda: own, delta_m=5.0)
    measure.decided(decision(instant(0), Tracks.empty()))
    summary = measure.summary(measure.course())
    assert summary.closest_hull is None
    assert summary.closest_set is None
    assert summary.oldest_used_s is None
    assert summary.contacts_heard == summary.ships_in_the_sea == 0
    empty = Measure(lambda t: Tracks.empty(), lambda: own, delta_m=5.0)
    course = empty.course()
    with pytest.raises(ValueError, match="nothing was measured"):
        empty.summary(course)


def test_guard_changes_are_counted_and_sized() -> None:
    own = OwnState(Instant(0), 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), None)
    measure = Measure(ship_at, lambda: own, delta_m=5.0)
    wanted = (3.0, 4.0, 0.0)
    for k, given_mps in enumerate((wanted, (3.0, 0.0, 0.0), None, wanted)):
        t = instant(k / 10)
        setpoint = None if given_mps is None else Setpoint(t, t, given_mps)
        changed = given_mps != wanted
        measure.decided(
            decision(t, Tracks.empty(), wanted_ned_mps=wanted, setpoint=setpoint, guard_changed=changed)
        )
    guard = measure.summary(measure.course()).guard
    assert (guard.steps, guard.share, guard.largest_mps, guard.closed_steps) == (1, 0.25, 4.0, 1)


def test_the_tube_steered_by_is_read_from_the_decisions() -> None:
    near = Nearest(np.array([33.0]), np.array([[1.0, 0.0]]))
    push = Repulsion(near, np.array([[1.0, 0.0]]), np.array([True]))
    measure = still_vehicle(0.0, repulsion=push, oldest_used_s=12.0)
    summary = measure.summary(measure.course())
    assert summary.closest_tube_m == 33.0
    assert summary.oldest_used_s == 12.0
    assert summary.step_time.p50_ms == pytest.approx(1.0)
    assert summary.step_time.most_ms == pytest.approx(2.0)


def test_the_summary_is_json_and_a_table() -> None:
    measure = still_vehicle(85.0)
    summary = measure.summary(measure.course())
    tables = msgspec.json.decode(summary.to_json())
    assert tables["closest_set"]["mmsi"] == 230_000_001
    assert len(tables["failures"]) == 2
    console = Console(width=120, file=io.StringIO())
    console.print(summary.table())
    assert isinstance(console.file, io.StringIO)
    assert "2.5 m" in console.file.getvalue()


@given(
    turns=st.lists(st.floats(-24.0, 24.0), min_size=3, max_size=60),
    limit_m=st.floats(-50.0, 50.0),
    jumps=st.lists(st.integers(1, 400), max_size=3),
)
def test_a_sparse_search_finds_what_a_full_search_finds(
    turns: list[float], limit_m: float, jumps: list[int]
) -> None:
    """Any distance that changes no faster than the closing speed but where it jumps, ten steps a second."""
    curve = np.cumsum(np.repeat(turns, 7)) * 0.1
    steps = np.array([k for k in jumps if k < len(curve)], dtype=np.int64)
    for k in steps:
        curve[k:] -= 40.0

    def distance_m(step: int) -> FloatArray:
        return np.array([1e3, curve[step]])

    found = search(np.arange(len(curve)) / 10, distance_m, steps, limit_m)
    least = found.least()
    assert least is not None
    assert found.nearest_m[least] == curve.min()
    assert set(np.flatnonzero(curve < limit_m)) <= set(found.step.tolist())
    assert (found.row == 1).all() or curve.max() > 1e3


@given(
    heading=st.floats(-math.pi, math.pi),
    north=st.floats(-200, 200),
    east=st.floats(-200, 200),
    hull=st.tuples(*[st.floats(1, 150)] * 4),
)
def test_the_distance_to_a_hull_is_that_of_a_polygon_library(
    heading: float, north: float, east: float, hull: tuple[float, float, float, float]
) -> None:
    bow, stern, port, starboard = hull
    truth = replace(
        true_tracks(
            Instant(0),
            mmsi=np.array([1]),
            position_m=np.zeros((1, 2)),
            course_rad=np.array([heading]),
            speed_mps=np.ones(1),
            hulls=hull_array([Hull(*hull)]),
            names=("",),
        )
    )
    # shapely's x, y are east, north; a heading turns clockwise
    polygon = affinity.rotate(box(-port, -stern, starboard, bow), -math.degrees(heading), origin=(0, 0))
    point = Point(east, north)
    inside = polygon.contains(point)
    expected = -polygon.exterior.distance(point) if inside else polygon.distance(point)
    assert to_hulls(truth, np.array((north, east)))[0] == pytest.approx(expected, abs=1e-6)
    sets = reach.at(truth, Instant(0)).nearest(np.array((north, east)))
    assert sets.distance_m[0] == pytest.approx(expected, abs=1e-6)


def test_a_hull_of_unknown_heading_is_the_circle_it_lies_in() -> None:
    truth = replace(ship_at(instant(60)), heading_error_rad=np.array([math.pi]))
    assert to_hulls(truth, np.zeros(2))[0] == pytest.approx(100.0 - math.hypot(60.0, 12.5))
