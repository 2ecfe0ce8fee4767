"""The paper's ships and their AIS, checked against formulas and an independent decoder."""

import math
from itertools import pairwise

import numpy as np
import pytest
from nmea2000 import backend
from nmea2000._canboat import Reassembler, can_id_decompose
from pymap3d.vincenty import vdist

from companion.geodesy import LocalFrame
from companion.instant import Instant, instant
from companion.messages import Hull
from sitl.ais import KNOT_MPS, AisPosition, AisStatic, reporting_interval_s, representable_speed_mps
from sitl.bus import AisReceiver, CanData, GnssReceiver
from sitl.traffic import Fleet, Noise, NoiseKind, Ship

FRAME = LocalFrame(60.0, 19.2)
UTC_NS = 1_780_000_000_250_000_000  # instant 0 is not on a whole second
HULL = Hull(55.0, 20.0, 10.0, 15.0)
SPEED = representable_speed_mps(5.0)


def fleet(kind: NoiseKind, seed: int = 1, east_m: float = 0.0) -> Fleet:
    ships = tuple(
        Ship(230_000_001 + i, f"SHIP {i}", -900.0 * i, east_m, 0.0 if i % 2 else math.pi, SPEED, HULL)
        for i in range(6)
    )
    rng = np.random.default_rng(seed)
    return Fleet(
        ships, Noise(kind), rng, FRAME, utc_ns_at_zero=UTC_NS, begin=instant(-100.0), end=instant(700.0)
    )


@pytest.mark.parametrize("kind", ["none", "constant", "interval", "white"])
def test_every_ship_stays_in_the_velocity_sector_of_its_nominal_motion(kind: NoiseKind) -> None:
    ships = fleet(kind)
    rng = np.random.default_rng(2)
    for a, b in np.sort(rng.uniform(-100.0, 700.0, (200, 2)), axis=1):
        moved = ships.antenna_m(instant(b)) - ships.antenna_m(instant(a))
        nominal = np.array([(math.cos(s.course_rad), math.sin(s.course_rad)) for s in ships.ships])
        along = np.sum(moved * nominal, axis=1)
        across = moved[:, 1] * nominal[:, 0] - moved[:, 0] * nominal[:, 1]
        run = np.hypot(*moved.T)
        slack = 1e-6 * (b - a) + 1e-6
        assert np.all(run <= (SPEED + 0.05) * (b - a) + slack)
        assert np.all(along >= (SPEED - 0.05) * math.cos(0.01) * (b - a) - slack)
        assert np.all(np.abs(across) <= along * math.tan(0.01) + slack)


def test_the_truths_speed_and_course_are_the_derivative_of_its_position() -> None:
    ships = fleet("interval")
    for t in (3.0, 44.4, 312.7):
        a, b = ships.antenna_m(instant(t)), ships.antenna_m(instant(t + 1e-3))
        truth = ships.truth(instant(t))
        velocity = (b - a) / 1e-3
        assert np.hypot(*velocity.T) == pytest.approx(truth.sog_mps, abs=1e-5)
        assert np.cos(np.arctan2(velocity[:, 1], velocity[:, 0]) - truth.cog_rad) == pytest.approx(1.0)


def test_constant_noise_is_a_corner_and_the_same_seed_gives_the_same_sea() -> None:
    truth = fleet("constant").truth(instant(5.0))
    assert np.abs(truth.sog_mps - SPEED) == pytest.approx(0.05)
    again = fleet("constant").truth(instant(5.0))
    assert np.array_equal(truth.north_m, again.north_m)
    assert not np.array_equal(truth.north_m, fleet("constant", seed=2).truth(instant(5.0)).north_m)


def test_white_noise_averages_out_which_is_why_it_proves_nothing() -> None:
    ships = fleet("white")
    moved = ships.antenna_m(instant(600.0)) - ships.antenna_m(instant(0.0))
    assert np.all(np.abs(np.abs(moved[:, 0]) - SPEED * 600.0) < 10.0)


def test_reports_state_the_nominal_motion_at_the_last_whole_utc_second() -> None:
    ships = fleet("constant")
    sent = ships.on_the_air(instant(0.0), instant(60.0))
    positions = [(t, r) for t, r in sent if isinstance(r, AisPosition)]
    assert len(positions) == 6 * 6  # every 10 s
    assert [t for t, _ in sent] == sorted(t for t, _ in sent)
    for t, said in positions:
        fix = Instant((UTC_NS + t) // 10**9 * 10**9 - UTC_NS)
        i = [s.mmsi for s in ships.ships].index(said.mmsi)
        assert said.utc_second == (UTC_NS + t) // 10**9 % 60
        assert said.sog_mps == pytest.approx(SPEED, abs=1e-12)
        north, east = FRAME.to_local(said.latitude_deg, said.longitude_deg)
        assert math.hypot(*(np.array((north, east)) - ships.antenna_m(fix)[i])) < 0.12


def test_courses_are_true_at_the_ship_not_at_the_frames_origin() -> None:
    ships = fleet("none", east_m=8000.0)  # the meridians converge by 0.12 degrees on the way there
    a, b = (FRAME.to_geodetic(*ships.antenna_m(instant(t))[1]) for t in (0.0, 100.0))
    _, azimuth_deg = vdist(*a, *b)
    said = next(
        r for _, r in ships.on_the_air(instant(0.0), instant(60.0))
        if r.mmsi == ships.ships[1].mmsi and isinstance(r, AisPosition)
    )  # fmt: skip
    assert float(azimuth_deg) > 0.1
    assert math.degrees(said.cog_rad) == pytest.approx(float(azimuth_deg), abs=0.051)


def test_every_report_is_sent_once_however_time_is_cut() -> None:
    ships = fleet("constant")
    whole = ships.on_the_air(instant(-50.0), instant(500.0))
    cuts = [instant(0.1 * k) for k in range(-500, 5001)]
    parts = [item for a, b in pairwise(cuts) for item in ships.on_the_air(a, b)]
    assert parts == whole
    assert sum(isinstance(r, AisStatic) for _, r in whole) in range(6, 13)  # every 6 min


@pytest.mark.parametrize(("knots", "every_s"), [(0.1, 180.0), (9.7, 10.0), (18.0, 6.0), (30.0, 2.0)])
def test_reporting_intervals_are_those_of_class_a(knots: float, every_s: float) -> None:
    assert reporting_interval_s(knots * KNOT_MPS) == every_s


def decoded(frames: list[CanData]) -> list[dict[str, object]]:
    """Through canboat's own reassembly and database."""
    assembler, out = Reassembler(), []
    for can_id, data in frames:
        priority, pgn, source, destination = can_id_decompose(can_id)
        payload = data
        if backend.is_fast_pgn(pgn):
            payload = assembler.push(pgn, data, source, destination, priority)
        if payload is not None:
            message = backend.decode(pgn, payload, source, destination, priority, "si")
            assert message is not None
            out.append({"pgn": pgn, "source": source, **{f.id: f.raw_value for f in message.fields}})
    return out


def test_a_position_report_on_the_bus_says_what_was_on_the_air() -> None:
    said = AisPosition(230_000_001, 60.0123, -19.2345, 59, math.radians(359.9), 4.9902, math.radians(359.0))
    receiver = AisReceiver()
    frames = receiver.say(said)
    assert len(frames) == 5
    assert all(can_id >> 26 == 4 and len(data) == 8 for can_id, data in frames)
    (heard,) = decoded(frames)
    assert (heard["pgn"], heard["userId"], heard["timeStamp"]) == (129038, 230_000_001, 59)
    assert heard["latitude"] == pytest.approx(60.0123, abs=1e-7)
    assert heard["longitude"] == pytest.approx(-19.2345, abs=1e-7)
    assert heard["cog"] == pytest.approx(said.cog_rad, abs=0.6e-4)
    assert heard["sog"] == pytest.approx(4.99)
    assert heard["heading"] == pytest.approx(said.heading_rad, abs=0.6e-4)
    assert frames[0][1][0] >> 5 != receiver.say(said)[0][1][0] >> 5  # the sequence counter moves on


def test_static_data_on_the_bus_says_what_was_on_the_air() -> None:
    (heard,) = decoded(AisReceiver().say(AisStatic(230_000_001, "ONE", "SITL", 9_000_000, 70, HULL, 8.0)))
    assert heard["pgn"] == 129794
    assert (heard["length"], heard["beam"]) == (75.0, 25.0)
    assert (heard["positionReferenceFromBow"], heard["positionReferenceFromStarboard"]) == (55.0, 15.0)
    assert (heard["typeOfShip"], heard["draft"]) == (70, 8.0)


def test_the_bus_tells_utc_and_own_position() -> None:
    clock, fix = decoded(GnssReceiver().say(UTC_NS, 60.0, 19.2))
    assert (clock["pgn"], fix["pgn"]) == (126992, 129029)
    for message in (clock, fix):
        days, seconds = message["date"], message["time"]
        assert isinstance(days, int)
        assert isinstance(seconds, float)
        assert days * 86_400 + seconds == pytest.approx(UTC_NS * 1e-9, abs=1e-3)
    assert fix["latitude"] == pytest.approx(60.0)
