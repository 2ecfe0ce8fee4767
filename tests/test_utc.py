from hypothesis import given
from hypothesis import strategies as st

from companion.instant import NS_PER_S, Instant, instant
from companion.messages import Source, UtcTime
from companion.utc import MEMORY, STEP_EVIDENCE, UtcClock

EPOCH = 1_669_809_600 * NS_PER_S
DAYS_13_9 = round(13.9 * 86_400) * NS_PER_S


def said(t_s: float, utc_ns: int, late_s: float = 0.0) -> UtcTime:
    return UtcTime(instant(t_s + late_s), Source.NMEA2000, utc_ns)


def test_it_knows_nothing_before_the_first_statement() -> None:
    assert UtcClock().utc_ns(instant(5.0)) is None


def test_it_runs_on_with_the_source_clock_between_statements() -> None:
    clock = UtcClock()
    clock.observe(said(100.0, EPOCH))
    assert clock.utc_ns(instant(160.5)) == EPOCH + round(60.5 * NS_PER_S)
    assert clock.utc_ns(instant(99.0)) == EPOCH - NS_PER_S


@given(st.lists(st.floats(0.0, 1.5), min_size=1, max_size=60))
def test_the_least_delayed_of_the_last_statements_sets_the_clock(delays_s: list[float]) -> None:
    clock = UtcClock()
    for k, late_s in enumerate(delays_s):
        clock.observe(said(float(k), EPOCH + k * NS_PER_S, late_s))
    at = len(delays_s)
    utc = clock.utc_ns(instant(at))
    assert utc is not None
    behind_s = (EPOCH + at * NS_PER_S - utc) / NS_PER_S
    assert abs(behind_s - min(delays_s[-MEMORY:])) < 1e-6
    assert clock.steps == 0


def test_a_single_absurd_statement_changes_nothing() -> None:
    clock = UtcClock()
    for k in range(5):
        clock.observe(said(k, EPOCH + k * NS_PER_S))
    clock.observe(said(5.0, EPOCH - DAYS_13_9))
    clock.observe(said(6.0, EPOCH + 6 * NS_PER_S))
    assert clock.utc_ns(instant(7.0)) == EPOCH + 7 * NS_PER_S
    assert (clock.steps, clock.doubts) == (0, 1)


def test_utc_that_jumps_back_by_13_9_days_is_counted_once_and_followed() -> None:
    clock = UtcClock()
    for k in range(10):
        clock.observe(said(k, EPOCH + k * NS_PER_S))
    for k in range(10, 10 + STEP_EVIDENCE - 1):
        clock.observe(said(k, EPOCH - DAYS_13_9 + k * NS_PER_S))
        assert clock.utc_ns(instant(k)) == EPOCH + k * NS_PER_S
    for k in range(10 + STEP_EVIDENCE - 1, 20):
        clock.observe(said(k, EPOCH - DAYS_13_9 + k * NS_PER_S))
        assert clock.utc_ns(instant(k)) == EPOCH - DAYS_13_9 + k * NS_PER_S
    assert clock.steps == 1


def test_a_source_clock_that_jumps_back_is_a_step_as_well() -> None:
    clock = UtcClock()
    for k in range(10):
        clock.observe(said(1_209_600.0 + k, EPOCH + k * NS_PER_S))
    for k in range(10, 20):
        clock.observe(said(float(k), EPOCH + k * NS_PER_S))
    assert clock.utc_ns(instant(20.0)) == EPOCH + 20 * NS_PER_S
    assert clock.steps == 1


def test_two_sources_that_contradict_each_other_do_not_make_it_flap() -> None:
    clock = UtcClock()
    for k in range(40):
        clock.observe(said(k, EPOCH + k * NS_PER_S))
        clock.observe(said(k, EPOCH + (k + 18) * NS_PER_S))
    assert clock.utc_ns(instant(40.0)) == EPOCH + 40 * NS_PER_S
    assert clock.steps == 0
    assert clock.doubts == 40


@given(st.lists(st.tuples(st.integers(-(2**62), 2**62), st.integers(-(2**62), 2**62)), max_size=50))
def test_no_statement_makes_it_raise(statements: list[tuple[int, int]]) -> None:
    clock = UtcClock()
    for stamp, utc_ns in statements:
        clock.observe(UtcTime(Instant(stamp), Source.MAVLINK, utc_ns))
    assert (clock.utc_ns(instant(0.0)) is None) == (not statements)
