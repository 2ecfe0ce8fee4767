"""The gate's filter against filterpy's general one, and its second mode: a ship that turns."""

import math
from typing import Any

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from hypothesis import given, settings
from hypothesis import strategies as st

from companion import config
from companion.messages import ContactReport, TargetKind
from companion.picture.bounds import Assumptions
from companion.picture.plausibility import GATE, Gate
from companion.picture.straight_filter import VELOCITY_SIGMA_MPS, Motion, update
from companion.picture.turning_mode import turn
from tests.contact_reports import picture, report

GATEKEEPER = Gate(Assumptions(config.Contacts()))


def general(reports: list[ContactReport], places: list[tuple[float, float]]) -> list[float]:
    """Innovations of a four-state filter on one plane, everything written out."""
    first = reports[0]
    assert first.sog_mps is not None
    sigma = 10.0 / 2
    kalman = KalmanFilter(dim_x=4, dim_z=4)
    kalman.x = np.array((*places[0], *velocity(first)))
    kalman.P = np.diag((sigma**2, sigma**2, 0.25, 0.25))
    found = []
    for before, now, place in zip(reports, reports[1:], places[1:], strict=False):
        dt = (now.measured_at - before.measured_at) * 1e-9
        f = np.eye(4)
        f[0, 2] = f[1, 3] = dt
        kalman.predict(F=f, Q=np.diag([(0.25 * dt * dt) ** 2] * 2 + [(0.5 * dt) ** 2] * 2))
        z = np.array((*place, *velocity(now)))
        kalman.update(z, R=np.diag((sigma**2, sigma**2, 0.25, 0.25)), H=np.eye(4))
        found.append(float(kalman.y @ kalman.SI @ kalman.y + np.linalg.slogdet(kalman.S)[1]))
    return found


def velocity(one: ContactReport) -> tuple[float, float]:
    assert one.sog_mps is not None
    assert one.cog_rad is not None
    return one.sog_mps * math.cos(one.cog_rad), one.sog_mps * math.sin(one.cog_rad)


@given(st.lists(st.tuples(st.floats(1, 60), st.floats(-9, 9), st.floats(-0.2, 0.2)), min_size=2, max_size=6))
@settings(max_examples=40)
def test_the_cheap_filter_is_filterpy_s(steps: list[tuple[float, float, float]]) -> None:
    at, north, east = 0.0, 0.0, 0.0
    reports, places = [report(0.0)], [(0.0, 0.0)]
    for dt, off, turned in steps:
        at, north, east = at + dt, north + 5.0 * dt, east + off
        reports.append(report(at, north, east, cog_rad=turned))
        places.append((north, east))
    motion = GATEKEEPER.begin(reports[0])
    for expected, now in zip(general(reports, places), reports[1:], strict=True):
        judged = GATEKEEPER.judge(motion, now)
        motion = judged.motion
        if judged.surprise < GATE[4]:
            assert judged.surprise == pytest.approx(expected, rel=2e-3, abs=0.05)
        else:
            return  # refused: the second mode may begin anew


NUMBER = st.floats(-500.0, 500.0)
SIZE = st.floats(0.1, 100.0)


@given(
    st.tuples(NUMBER, NUMBER, NUMBER, NUMBER),
    st.tuples(SIZE, st.floats(-0.9, 0.9), SIZE),
    st.tuples(NUMBER, NUMBER),
    st.none() | st.tuples(NUMBER, NUMBER),
    st.floats(0.0, 60.0),
    st.tuples(SIZE, SIZE),
    st.floats(1.0, 50.0),
)
def test_one_step_of_the_gate_s_filter_is_filterpy_s_number_for_number(
    state: tuple[float, float, float, float],
    spread: tuple[float, float, float],
    moved: tuple[float, float],
    speed: tuple[float, float] | None,
    dt: float,
    drift: tuple[float, float],
    sigma: float,
) -> None:
    """State, covariance, innovation and |S| of any step, with a velocity and without, within 1e-9."""
    one = report(0.0)
    p, v = spread[0], spread[2]
    b = spread[1] * math.sqrt(p * v)
    innovation, det, motion = update(Motion(one, *state, p, b, v), one, moved, speed, dt, drift, sigma)

    size = 2 if speed is None else 4
    kalman = KalmanFilter(dim_x=4, dim_z=size)
    kalman.x, kalman.P = np.array(state), np.kron(((p, b), (b, v)), np.eye(2))
    f = np.kron(((1.0, dt), (0.0, 1.0)), np.eye(2))
    kalman.predict(F=f, Q=np.diag(np.repeat(drift, 2)))
    noise = np.diag((sigma**2, sigma**2, VELOCITY_SIGMA_MPS**2, VELOCITY_SIGMA_MPS**2)[:size])
    kalman.update(np.array((*moved, *(speed or ()))), R=noise, H=np.eye(4)[:size])

    after = np.array((motion.north_m, motion.east_m, motion.north_mps, motion.east_mps))
    assert after + np.array((*moved, 0.0, 0.0)) == pytest.approx(kalman.x, rel=1e-9, abs=1e-9)
    a, b, c = motion.position_m2, motion.both_m2ps, motion.velocity_m2ps2
    scale = float(np.abs(kalman.P_prior).max())
    assert np.kron(((a, b), (b, c)), np.eye(2)) == pytest.approx(kalman.P, rel=1e-9, abs=1e-9 * scale)
    assert innovation == pytest.approx(float(kalman.y @ kalman.SI @ kalman.y), rel=1e-9, abs=1e-9)
    assert 2 * math.log(det) == pytest.approx(float(np.linalg.slogdet(kalman.S)[1]), rel=1e-9, abs=1e-9)


def test_a_turn_is_a_rotation_of_the_velocity_along_an_arc() -> None:
    """A quarter turn to starboard at 1 rad in 100 s, from 5 m/s north: radius 500 m."""
    rate = 0.01
    after = turn(rate, math.pi / 2 / rate) @ np.array((0.0, 0.0, 5.0, 0.0))
    assert after == pytest.approx([500.0, 500.0, 0.0, 5.0])


def test_a_ship_in_a_steady_hard_turn_is_believed_and_one_that_leaps_is_not() -> None:
    """Class A with 16 m/s turning 3 deg/s, heard every 20 s: the straight filter alone would refuse it."""
    rate, speed = math.radians(3.0), 15.0

    def at(t: float, **other: object) -> ContactReport:
        north, east = speed / rate * math.sin(rate * t), speed / rate * (1 - math.cos(rate * t))
        return report(t, north, east, sog_mps=speed, cog_rad=(rate * t) % math.tau, **other)

    turning = picture(*(at(20.0 * i) for i in range(8)))
    assert turning.counts["picture.quarantined"] == 0
    leaping = picture(at(0.0), at(20.0), report(40.0, 3000.0, -2000.0))
    assert leaping.counts["picture.quarantined"] == 1


def test_without_a_velocity_position_alone_is_judged() -> None:
    kinds: Any = {"sog_mps": None, "cog_rad": None, "kind": TargetKind.CLASS_A}
    motion = GATEKEEPER.begin(report(0.0, **kinds))
    assert GATEKEEPER.judge(motion, report(10.0, 40.0, 0.0, **kinds)).plausible
    assert not GATEKEEPER.judge(motion, report(10.0, 4000.0, 0.0, **kinds)).plausible
