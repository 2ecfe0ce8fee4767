"""The picture: drawn to scale, from any run, without a warning."""

import math
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Point, Polygon

from companion.geodesy import LocalFrame
from companion.instant import Instant, instant
from companion.messages import Decision, FloatArray, Hull, OwnState, Phase, Reason, Status, Tracks
from sitl.chart import DPI, HEIGHT_IN, WIDTH_IN, Channel, Scene, draw
from sitl.chart.labels import degrees
from sitl.chart.scene import Window, hull_outlines, snapshots, window
from sitl.measure import Measure
from sitl.truth import hull_array, true_tracks

FRAME = LocalFrame(59.9, 19.2)
SEA = Window((-500.0, 500.0), (-500.0, 500.0))


def ships(t: Instant, n: int = 4, heading_rad: float = 0.3) -> Tracks:
    run_m = 5.0 * t * 1e-9
    north_m = np.arange(n) * 150.0 - 300.0 + run_m * math.cos(heading_rad)
    return true_tracks(
        t,
        mmsi=np.arange(n) + 230_000_001,
        position_m=np.column_stack((north_m, np.full(n, 200.0 + run_m * math.sin(heading_rad)))),
        course_rad=np.full(n, heading_rad),
        speed_mps=np.full(n, 5.0),
        hulls=hull_array([Hull(60.0, 15.0, 15.0, 10.0)] * n),
        names=tuple(f"SHIP {i}" for i in range(n)),
    )


def run(
    goal_m: FloatArray, seconds: int = 100, n: int = 4, moving: bool = True, validity_s: float = 600.0
) -> Measure:
    own = [OwnState(Instant(0), 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), None)]
    measure = Measure(lambda t: ships(t, n), lambda: own[0], delta_m=5.0)
    column = np.ones(n)
    heard = replace(
        ships(instant(0), n),
        revision=1,
        speed_noise_mps=0.05 * column,
        course_noise_rad=0.01 * column,
        disc_speed_mps=16.0 * column,
        top_speed_mps=16.0 * column,
        validity_s=validity_s * column,
    )
    for k in range(seconds):
        share = k / seconds if moving else 0.0
        t = instant(k)
        own[0] = OwnState(t, share * goal_m[0], share * goal_m[1], 45.0 * share, (0.0, 0.0, 0.0), None)
        measure.timed(t, 1e-3)
        measure.decided(
            Decision(
                t=t,
                phase=Phase.CROSS if k > 10 and moving else Phase.LISTEN,
                status=Status.OK,
                reasons=(Reason("plan.goal_occupied", "a ship can be at the goal: no way through"),),
                own=own[0],
                tracks=heard,
                repulsion=None,
                attraction_mps=None,
                wanted_ned_mps=None,
                setpoint=None,
                guard_changed=False,
                outgoing=(),
            )
        )
    return measure


def picture(
    path: Path, measure: Measure, goal_m: FloatArray, channel: Channel | None = None
) -> tuple[int, int]:
    """Draw; width and height out of the PNG's header."""
    course = measure.course()
    scene = Scene("A crossing", FRAME, np.zeros(2), goal_m, 15.0, channel)
    draw(path, course, measure.summary(course), scene)
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", head[16:])
    return width, height


STATED = (int(WIDTH_IN * DPI), int(HEIGHT_IN * DPI))


@pytest.mark.parametrize("goal", [(0.0, 400.0), (400.0, 0.0), (-300.0, -310.0)])
def test_a_crossing_in_any_direction_is_drawn_at_the_stated_size(
    goal: tuple[float, float], tmp_path: Path
) -> None:
    goal_m = np.array(goal)
    channel = Channel(goal_m / 2, 0.3, 230.0)
    assert picture(tmp_path / "crossing.png", run(goal_m), goal_m, channel) == STATED


def test_a_refusal_has_a_picture_too(tmp_path: Path) -> None:
    goal_m = np.array((0.0, 400.0))
    assert picture(tmp_path / "crossing.png", run(goal_m, moving=False), goal_m) == STATED


def test_a_single_step_without_a_ship_has_a_picture(tmp_path: Path) -> None:
    goal_m = np.array((0.0, 0.0))
    assert picture(tmp_path / "crossing.png", run(goal_m, seconds=1, n=0), goal_m) == STATED


def test_ships_that_can_be_anywhere_do_not_paint_the_picture_over(tmp_path: Path) -> None:
    goal_m = np.array((0.0, 400.0))
    measure = run(goal_m, validity_s=10.0)
    assert picture(tmp_path / "crossing.png", measure, goal_m) == STATED
    course = measure.course()
    scene = Scene("", FRAME, np.zeros(2), goal_m, 15.0)
    moments = snapshots(course, window(course, scene, 1.0))
    assert moments[-1].everywhere == 4
    assert moments[-1].sets_m == ()
    assert moments[0].everywhere == 0


@given(
    heading=st.floats(-math.pi, math.pi),
    hull=st.tuples(*[st.floats(1.0, 150.0)] * 4),
    at=st.tuples(st.floats(-300, 300), st.floats(-300, 300)),
)
def test_a_hull_is_drawn_to_scale_around_its_antenna(
    heading: float, hull: tuple[float, float, float, float], at: tuple[float, float]
) -> None:
    bow, stern, port, starboard = hull
    truth = true_tracks(
        Instant(0),
        mmsi=np.array([1]),
        position_m=np.array([at]),
        course_rad=np.array([heading]),
        speed_mps=np.ones(1),
        hulls=hull_array([Hull(*hull)]),
        names=("",),
    )
    (outline,) = hull_outlines(truth, Instant(0), SEA)
    ahead = np.array((math.cos(heading), math.sin(heading)))
    right = np.array((-ahead[1], ahead[0]))
    along, across = (outline - at) @ ahead, (outline - at) @ right
    assert (along.max(), -along.min()) == pytest.approx((bow, stern))
    assert (across.max(), -across.min()) == pytest.approx((starboard, port))
    at_the_stern = np.isclose(along, -stern)
    assert sorted(across[at_the_stern].tolist()) == pytest.approx([-port, starboard])
    rectangle = (bow + stern) * (port + starboard)
    assert Polygon(outline).area == pytest.approx(rectangle * (1 - 1 / 16))


def test_a_hull_of_unknown_heading_is_drawn_as_a_circle() -> None:
    truth = replace(ships(instant(0), 1), heading_error_rad=np.array([math.pi]))
    (outline,) = hull_outlines(truth, Instant(0), SEA)
    radius = np.hypot(*(outline - (truth.north_m[0], truth.east_m[0])).T)
    assert radius == pytest.approx(np.full(len(radius), math.hypot(60.0, 15.0)), rel=1e-3)


def test_ships_outside_the_window_are_left_out() -> None:
    far = replace(ships(instant(0), 1), east_m=np.array([5_000.0]))
    assert hull_outlines(far, Instant(0), SEA) == ()


def test_every_set_drawn_holds_the_hull_drawn_with_it() -> None:
    goal_m = np.array((0.0, 400.0))
    course = run(goal_m).course()
    for moment in snapshots(course, window(course, Scene("", FRAME, np.zeros(2), goal_m, 15.0), 1.0)):
        for hull, outline in zip(moment.hulls_m, moment.sets_m, strict=True):
            covered = Polygon(outline)  # convex: it holds the hull if it holds the corners
            assert max(covered.distance(Point(corner)) for corner in hull) < 1e-6


def test_the_window_has_the_asked_aspect_and_holds_the_way() -> None:
    goal_m = np.array((100.0, 2_000.0))
    course = run(goal_m).course()
    view = window(course, Scene("", FRAME, np.zeros(2), goal_m, 15.0), 1.25)
    assert view.half_m[1] / view.half_m[0] == pytest.approx(1.25)
    assert view.holds(course.position_m).all()
    assert view.holds(goal_m)
    assert view.holds(view.border_toward(np.array((9e4, 1e3))) * 0.999)


def test_positions_read_like_on_a_chart() -> None:
    assert degrees(59.72134, "N", "S") == "59.7213° N"
    assert degrees(-0.5, "E", "W") == "0.5000° W"
