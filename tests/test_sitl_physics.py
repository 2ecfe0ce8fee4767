"""The bundled hulls as physics: what holds whatever the coefficients, and what is published of these."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl import boat, torpedo
from sitl.boat import Boat, BoatState
from sitl.rigid_body import Six, coriolis, energy_j, runge_kutta, to_body, to_ned
from sitl.rover import TRACK_M, Rover, WheelState
from sitl.submarine import BodyState, Submarine
from sitl.torpedo import MASS, SCALE, Actuators
from sitl.vehicle import Demand, Dynamics, Limits, VehicleState

rates = st.floats(-3.0, 3.0)
motions = st.tuples(rates, rates, rates, rates, rates, rates)


def under_way(speed: float) -> BodyState:
    state = Submarine().start(0.0, 0.0, 100.0, 0.0)
    assert isinstance(state, BodyState)
    return replace(state, speed_mps=speed)


@given(motions)
def test_turning_axes_do_no_work(nu: Six) -> None:
    work = sum(a * b for a, b in zip(nu, coriolis(MASS, nu), strict=True))
    assert work == pytest.approx(0.0, abs=1e-8 * (1 + energy_j(MASS, nu)))


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3), rates, rates, rates)
def test_turning_into_body_axes_and_back_changes_nothing(
    roll: float, pitch: float, yaw: float, a: float, b: float, c: float
) -> None:
    there = to_ned(roll, pitch, yaw, (a, b, c))
    assert to_body(roll, pitch, yaw, there) == pytest.approx((a, b, c), abs=1e-12)
    assert math.hypot(*there) == pytest.approx(math.hypot(a, b, c))


def test_the_torpedos_energy_changes_by_the_work_done_on_it() -> None:
    actuators = Actuators(thrust_n=60.0, rudder_rad=0.2, planes_rad=-0.1, heave_n=10.0, yaw_nm=5.0)
    hull, state, dt = Submarine(), under_way(0.5), 0.01

    def power(body: BodyState) -> float:
        gravity = torpedo.restoring(
            math.sin(body.roll_rad), math.sin(body.pitch_rad), math.cos(body.pitch_rad)
        )
        net = zip(
            torpedo.forces(actuators, body.speed_mps), torpedo.damping(body.nu), gravity, body.nu, strict=True
        )
        return sum((t - d - g) * n for t, d, g, n in net)

    before, work = energy_j(MASS, state.nu), 0.0
    for _ in range(3000):
        new = hull.move(state, actuators, dt)
        work += 0.5 * dt * (power(state) + power(new))
        state = new
    assert energy_j(MASS, state.nu) - before == pytest.approx(work, rel=1e-3)


def test_without_motors_the_torpedo_only_loses_energy_until_it_drifts_with_the_water() -> None:
    hull, state = Submarine(Limits(), (0.3, -0.2)), under_way(2.5)
    seen = []
    for _ in range(400):
        seen.append(energy_j(MASS, state.nu))
        state = hull.move(state, Actuators(), 0.1)
    assert all(later <= earlier + 1e-9 for earlier, later in pairwise(seen))
    assert state.velocity_ned_mps[:2] == pytest.approx((0.3, -0.2), abs=0.6)


def test_the_published_thrust_gives_the_published_speed() -> None:
    # REMUS 100: 3.86 N at 1.54 m/s (Prestero); a similar body twice as large needs SCALE^2 of it
    hull, state = Submarine(), under_way(1.0)
    for _ in range(1200):
        state = hull.move(state, Actuators(thrust_n=3.86 * SCALE**2), 0.1)
    assert state.speed_mps == pytest.approx(1.54, abs=0.01)


def circle(rudder: float, speed: float) -> BodyState:
    hull, state = Submarine(), under_way(speed)
    for _ in range(1200):
        drag = torpedo.X_UU * speed * speed
        state = hull.move(state, Actuators(thrust_n=drag, rudder_rad=rudder), 0.1)
    return state


def test_with_presteros_own_coefficients_the_vehicle_turns_his_published_circle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # lift of body and fins: his Y_uv -28.6, Y_ur 5.22, N_uv -24, N_ur -2, less the added mass's share in C
    monkeypatch.setattr(torpedo, "Y_VV", 1310.0 * SCALE**2)
    monkeypatch.setattr(torpedo, "Y_UV", 28.6 * SCALE**2)
    monkeypatch.setattr(torpedo, "Y_UR", (5.22 + 0.93) * SCALE**3)
    monkeypatch.setattr(torpedo, "N_UV", (35.5 - 0.93 - 24.0) * SCALE**3)
    monkeypatch.setattr(torpedo, "N_UR", (2.0 + 1.93) * SCALE**4)
    hull, state = Submarine(), under_way(1.54)
    seen = []
    for step in range(900):
        state = hull.move(state, Actuators(3.86 * SCALE**2, rudder_rad=math.radians(4.0)), 0.05)
        if step * 0.05 > 15.0 * SCALE:
            seen.append((state.nu[5], state.nu[0], abs(state.nu[1])))
    turn, surge, sway = np.mean(seen, axis=0)
    # chapter 8, figures 8-1 to 8-3, 4 degrees of rudder: 9.0 deg/s, 1.38 to 1.40 m/s, 0.04 to 0.07 m/s;
    # a similar body SCALE times as long turns SCALE times as slowly at the same speeds
    assert math.degrees(turn) * SCALE == pytest.approx(9.0, abs=0.4)
    assert surge == pytest.approx(1.39, abs=0.03)
    assert sway == pytest.approx(0.055, abs=0.02)


def test_a_gentle_turning_circle_is_the_one_of_linear_theory() -> None:
    state = circle(0.0002, 2.0)
    u = state.speed_mps
    # steady sway and yaw: D(u) (v, r) = fin forces, C(nu) linearised in it
    d = np.array(
        (
            (torpedo.Y_UV * u, (MASS[0][0] - torpedo.Y_UR) * u),
            ((MASS[1][1] - MASS[0][0] - torpedo.N_UV) * u, (torpedo.N_UR + MASS[1][5]) * u),
        )
    )
    fins = np.array((-torpedo.Y_FIN, torpedo.N_FIN)) * u * u * 0.0002
    sway, turn = np.linalg.solve(d, fins)
    assert turn > 0 > sway  # the hull slides outward
    assert state.nu[5] == pytest.approx(turn, rel=0.05)
    assert state.nu[1] == pytest.approx(sway, rel=0.1)


def test_the_torpedo_holds_a_straight_course_by_itself() -> None:
    hull, state = Submarine(), replace(under_way(2.0), yaw_rate_radps=0.05)
    for _ in range(600):
        state = hull.move(state, Actuators(thrust_n=torpedo.X_UU * 4.0), 0.1)
    assert state.nu[5] == pytest.approx(0.0, abs=1e-4)


def test_a_turning_circle_is_as_wide_at_any_speed() -> None:
    slow, fast = circle(0.1, 1.0), circle(0.1, 2.0)
    radius = [math.hypot(s.nu[0], s.nu[1]) / s.nu[5] for s in (slow, fast)]
    assert radius[1] == pytest.approx(radius[0], rel=0.03)
    assert 2 * torpedo.LENGTH_M < radius[0] < 12 * torpedo.LENGTH_M
    tight = circle(0.3, 2.0)
    assert math.hypot(tight.nu[0], tight.nu[1]) / tight.nu[5] < radius[1]


def zigzag(speed: float) -> tuple[list[float], list[float]]:
    """Overshoots beyond 10 degrees and the times of the rudder's reversals, 10/10."""
    hull, state, rudder = Submarine(), under_way(speed), math.radians(10)
    overshoots, reversals, peak = [], [], 0.0
    for step in range(2400):
        state = hull.move(state, Actuators(torpedo.X_UU * speed * speed, rudder), 0.05)
        peak = max(peak, state.heading_rad * math.copysign(1.0, rudder) * -1.0)
        if state.heading_rad * math.copysign(1.0, rudder) >= math.radians(10):
            overshoots.append(peak - math.radians(10))
            reversals.append(step * 0.05)
            rudder, peak = -rudder, 0.0
    return overshoots[1:], reversals


def test_a_zig_zag_overshoots_a_little_and_is_faster_at_speed() -> None:
    overshoots, times = zigzag(2.0)
    assert len(overshoots) > 4
    assert all(0.0 < o < math.radians(15) for o in overshoots)
    _, slower = zigzag(1.0)
    period, longer = np.diff(times)[1:].mean(), np.diff(slower)[1:].mean()
    assert longer == pytest.approx(2 * period, rel=0.15)  # the same path, at half the speed


def dive(seconds: float) -> list[VehicleState]:
    hull = Submarine()
    states = [hull.start(0.0, 0.0, 0.0, 0.0)]
    for _ in range(round(seconds / 0.1)):
        down = min(max(0.5 * (45.0 - states[-1].depth_m), -0.5), 0.5)
        states.append(hull.step(states[-1], Demand((2.5, 0.0, down)), 0.1))
    return states


def test_a_dive_step_reaches_its_depth_at_the_wanted_rate_and_stays() -> None:
    states = dive(150.0)
    assert max(s.depth_m for s in states) < 45.5
    assert states[-1].depth_m == pytest.approx(45.0, abs=0.1)
    sink = (states[600].depth_m - states[300].depth_m) / 30.0
    assert sink == pytest.approx(0.5, abs=0.05)
    assert states[-1].speed_mps == pytest.approx(2.5, abs=0.02)
    assert min(s.pitch_rad for s in states) < -0.1  # it swims down, nose first


@settings(max_examples=15, deadline=None)
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_the_submarine_makes_good_the_wanted_velocity_against_the_current(
    north: float, east: float, drift_north: float, drift_east: float
) -> None:
    hull = Submarine(Limits(), (drift_north, drift_east))
    through = math.hypot(north - drift_north, east - drift_east)
    state = hull.start(0.0, 0.0, 20.0, 0.0)
    for _ in range(400):
        state = hull.step(state, Demand((north, east, 0.0)), 0.1)
    if 0.3 < through < 2.5:
        assert state.velocity_ned_mps[:2] == pytest.approx((north, east), abs=0.05)
    assert state.depth_m >= 0.0


@given(st.floats(-2, 2), st.floats(-1, 1), st.floats(-1, 1), st.floats(-500, 500), st.floats(-300, 300))
def test_the_boats_energy_changes_by_the_work_done_on_it(
    u: float, v: float, r: float, thrust: float, moment: float
) -> None:
    def rate(x: tuple[float, ...]) -> tuple[float, ...]:
        surge, sway, yaw, _ = x
        d = boat.drag(surge, sway, yaw)
        power = (thrust - d[0]) * surge - d[1] * sway + (moment - d[2]) * yaw
        return (*boat.acceleration(surge, sway, yaw, thrust, moment), power)

    x: tuple[float, ...] = (u, v, r, 0.0)
    for _ in range(100):
        x = runge_kutta(rate, x, 0.02)
    gained = boat.energy_j(x[0], x[1], x[2]) - boat.energy_j(u, v, r)
    assert gained == pytest.approx(x[3], rel=1e-4, abs=1e-2)


def sail(hull: Dynamics, demand: Demand | None, seconds: float, heading: float = 0.0) -> VehicleState:
    state = hull.start(0.0, 0.0, 0.0, heading)
    for _ in range(round(seconds / 0.1)):
        state = hull.step(state, demand, 0.1)
    return state


@settings(max_examples=20, deadline=None)
@given(st.floats(-2, 2), st.floats(-2, 2))
def test_a_boat_turns_velocity_into_heading_and_speed(north: float, east: float) -> None:
    state = sail(Boat(), Demand((north, east, 0.5)), 60.0)
    wanted = min(math.hypot(north, east), 2.5)
    assert state.depth_m == 0.0
    if wanted < 0.1:
        return
    assert math.hypot(*state.velocity_ned_mps[:2]) == pytest.approx(wanted, abs=0.02)
    if wanted > 0.2:
        assert math.cos(state.heading_rad - math.atan2(east, north)) == pytest.approx(1.0, abs=1e-3)


def test_the_physical_boat_is_set_by_a_current_swings_north_at_rest_and_holds_when_told() -> None:
    north, east, _ = sail(Boat(Limits(), (0.0, 0.5)), Demand((2.0, 0.0, 0.0)), 60.0).velocity_ned_mps
    assert math.degrees(math.atan2(east, north)) == pytest.approx(14.0, abs=1.5)
    assert sail(Boat(), Demand((0.0, 0.0, 0.0)), 60.0, 1.5).heading_rad == pytest.approx(0.0, abs=0.02)
    held = sail(Boat(), Demand((0.0, 0.0, 0.0), hold_heading=True), 30.0, 1.5)
    assert held.heading_rad == pytest.approx(1.5, abs=0.02)


def test_a_boats_turning_circle_slides_outward_and_slows_it() -> None:
    hull, state = Boat(), BoatState(0.0, 0.0, 0.0, 0.0, 1.5)
    thrust = boat.drag(1.5, 0.0, 0.0)[0]
    for _ in range(600):
        state = hull.move(state, thrust, 200.0, 0.1)
    assert state.turn_rate_radps > 0
    assert state.sway_mps < 0
    assert state.speed_mps < 1.5


@given(st.floats(-1, 1), st.floats(-1, 1))
def test_a_rovers_arc_is_the_arc_of_its_wheels(left: float, right: float) -> None:
    state = WheelState(0.0, 0.0, 0.0, 0.0, left_mps=left, right_mps=right)
    for _ in range(20):
        state = Rover().move(state, left, right, 0.1)
    speed, rate = (left + right) / 2, (left - right) / TRACK_M
    angle = 2.0 * rate
    radius_north = math.sin(angle) / rate if abs(rate) > 1e-6 else 2.0
    radius_east = (1 - math.cos(angle)) / rate if abs(rate) > 1e-6 else 0.0
    assert (state.north_m, state.east_m) == pytest.approx(
        (speed * radius_north, speed * radius_east), abs=1e-5
    )


def test_a_rover_turns_on_the_spot_and_then_drives() -> None:
    hull = Rover()
    state = hull.start(0.0, 0.0, 0.0, math.pi)
    for _ in range(100):
        state = hull.step(state, Demand((0.5, 0.0, 0.0)), 0.1)
    assert state.heading_rad == pytest.approx(0.0, abs=1e-2)
    assert state.speed_mps == pytest.approx(0.5, abs=1e-2)
    assert abs(state.east_m) < 0.2
