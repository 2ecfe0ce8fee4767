from companion.instant import instant
from companion.messages import Phase
from companion.planning.mission import Mission
from tests.builders import config, own

VEHICLE, GOAL = config().vehicle, config().goal


def step(mission: Mission, at_s: float, depth_m: float, to_goal_m: float = 900.0, **over: object) -> Phase:
    if not over.pop("ready", True):
        return mission.pause(instant(at_s))
    inputs = {"reports_heard": 1, "is_clear": lambda: True, **over}
    return mission.advance(instant(at_s), own=own(depth_m=depth_m), to_goal_m=to_goal_m, **inputs)  # type: ignore[arg-type]


def crossing() -> Mission:
    mission = Mission(VEHICLE, GOAL)
    step(mission, 0, 0)
    step(mission, 1, 0)
    step(mission, 1 + VEHICLE.listen_s, 0)
    assert mission.phase is Phase.CROSS
    return mission


def test_it_waits_until_the_vehicle_is_ready() -> None:
    mission = Mission(VEHICLE, GOAL)
    assert step(mission, 0, 0, ready=False) is Phase.WAIT
    assert step(mission, 1, 0) is Phase.LISTEN


def test_it_does_not_dive_before_a_report_was_heard() -> None:
    mission = Mission(VEHICLE, GOAL)
    for t in range(200):
        assert step(mission, t, 0, reports_heard=0) in (Phase.WAIT, Phase.LISTEN)
    assert step(mission, 200, 0, reports_heard=1) is Phase.CROSS


def test_it_does_not_leave_from_where_a_ship_can_be() -> None:
    mission = Mission(VEHICLE, GOAL)
    for t in range(200):
        assert step(mission, t, 0, is_clear=lambda: False) in (Phase.WAIT, Phase.LISTEN)
    assert step(mission, 200, 0) is Phase.CROSS


def test_listening_counts_only_at_the_surface() -> None:
    mission = Mission(VEHICLE, GOAL)
    step(mission, 0, 0)
    step(mission, 1, 0)
    step(mission, 50, 5.0)  # washed under
    assert step(mission, 61, 0) is Phase.LISTEN
    assert step(mission, 61 + VEHICLE.listen_s, 0) is Phase.CROSS


def test_a_surface_vehicle_is_surfaced_whatever_its_barometer_says() -> None:
    """Eight metres for every hectopascal of weather; a boat must not wait for ever to come up."""
    vehicle = config(vehicle={"cruise_depth_m": 0.0}).vehicle
    mission = Mission(vehicle, GOAL)
    step(mission, 0, 8.0)
    step(mission, 1, 8.0)
    assert step(mission, 1 + vehicle.listen_s, 8.0) is Phase.CROSS
    step(mission, 100, 8.0, to_goal_m=5.0)
    assert step(mission, 101, 8.0, to_goal_m=5.0) is Phase.ARRIVED


def test_it_surfaces_at_the_goal_only_into_clear_water() -> None:
    mission = crossing()
    assert step(mission, 500, 45, to_goal_m=5.0, is_clear=lambda: False) is Phase.CROSS
    assert mission.target_depth_m() == VEHICLE.cruise_depth_m
    assert step(mission, 501, 45, to_goal_m=5.0) is Phase.SURFACE
    assert mission.target_depth_m() == 0.0
    assert step(mission, 560, 0.5, to_goal_m=5.0) is Phase.ARRIVED


def test_driven_off_the_goal_it_goes_back_under() -> None:
    mission = crossing()
    step(mission, 500, 45, to_goal_m=5.0)
    assert step(mission, 510, 40, to_goal_m=100.0) is Phase.CROSS


def test_a_human_taking_over_freezes_the_phase() -> None:
    mission = crossing()
    assert step(mission, 500, 45, to_goal_m=5.0, ready=False) is Phase.CROSS


def test_after_a_long_pause_at_the_surface_it_listens_again() -> None:
    mission = crossing()
    for t in range(100, 100 + int(VEHICLE.listen_s) + 1):
        step(mission, t, 0, ready=False)
    assert step(mission, 200, 0) is Phase.LISTEN
    assert step(mission, 201, 0) is Phase.LISTEN
    assert step(mission, 202 + VEHICLE.listen_s, 0) is Phase.CROSS


def test_after_a_short_pause_it_goes_on() -> None:
    mission = crossing()
    step(mission, 100, 0, ready=False)
    assert step(mission, 110, 0) is Phase.CROSS
