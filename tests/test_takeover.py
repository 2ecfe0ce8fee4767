from companion.config import Autopilot
from companion.instant import instant
from companion.messages import Command, CommandAck
from companion.requests import MOST_TRIES, RETRY_S, SET_MESSAGE_INTERVAL, WANTED, MessageRequests
from companion.takeover import COMPONENT_ARM_DISARM, DO_SET_MODE, Takeover
from tests.builders import heartbeat

MANUAL = heartbeat(takes_setpoints=False, armed=False, mode="MANUAL")


def test_by_default_it_neither_arms_nor_changes_mode() -> None:
    takeover = Takeover(Autopilot())
    assert all(takeover.due(instant(t), MANUAL) is None for t in range(100))


def test_a_permitted_mode_change_is_repeated_until_it_succeeds_and_never_again() -> None:
    takeover = Takeover(Autopilot(may_set_mode=True, may_arm=True))
    asked = [takeover.due(instant(t / 10), MANUAL) for t in range(50)]
    assert [c.command for c in asked if c] == [DO_SET_MODE] * 3
    arm = takeover.due(instant(10), heartbeat(armed=False))
    assert arm is not None
    assert arm.command == COMPONENT_ARM_DISARM
    assert takeover.due(instant(20), heartbeat()) is None
    # now a human takes over: nothing is asked any more
    assert all(takeover.due(instant(30 + t), MANUAL) is None for t in range(100))


def test_the_mode_asked_for_is_the_vehicles_own() -> None:
    boat = Takeover(Autopilot(may_set_mode=True)).due(
        instant(0), heartbeat(vehicle="boat", takes_setpoints=False)
    )
    px4 = Takeover(Autopilot(may_set_mode=True)).due(
        instant(0), heartbeat(firmware="px4", vehicle="other", takes_setpoints=False)
    )
    strange = Takeover(Autopilot(may_set_mode=True)).due(
        instant(0), heartbeat(vehicle="other", takes_setpoints=False)
    )
    assert boat is not None
    assert boat.params[1] == 15.0
    assert px4 is not None
    assert px4.params[1] == 6.0
    assert strange is None


def test_streams_are_asked_for_one_at_a_time_until_each_is_answered() -> None:
    requests, heard, t = MessageRequests(), [], 0.0
    while (command := requests.due(instant(t))) is not None:
        assert command.command == SET_MESSAGE_INTERVAL
        assert requests.due(instant(t + 0.1)) is None
        heard.append(int(command.params[0]))
        requests.observe_ack(CommandAck(instant(t), SET_MESSAGE_INTERVAL, 0))
        t += 1.0
    assert heard == [message for message, _ in WANTED]
    assert requests.refused == ()


def test_an_autopilot_that_never_answers_is_not_asked_for_ever() -> None:
    requests = MessageRequests()
    asked: list[Command] = []
    for t in range(200):
        command = requests.due(instant(t * RETRY_S))
        if command is not None:
            asked.append(command)
    assert len(asked) == MOST_TRIES * len(WANTED)
    assert requests.refused == tuple(message for message, _ in WANTED)
