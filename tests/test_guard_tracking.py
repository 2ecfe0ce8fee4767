"""The bundled vehicles in six and three degrees of freedom keep as near to a way out as is declared."""

import numpy as np
import pytest

from companion.config import Guard as GuardSection
from companion.instant import Instant, elapsed_s, instant
from companion.messages import AutopilotHeartbeat, OwnState, Reason
from companion.planning.guard import Guard
from companion.planning.guard.margins import BETWEEN_M, RAMP_S
from companion.planning.guard.watch import Watch
from companion.planning.guard.way_out import WayOut
from sitl.studies.bad_vehicle import BadVehicle
from sitl.studies.guard import TRACKING_M, configuration
from sitl.studies.hostile import hostile, intending
from sitl.studies.lanes_picture import Lanes


class Watched(Watch):
    """Keeps how far the vehicle was from the way out it flew, and how long after its begin."""

    seen: list[tuple[float, float]]
    courses = 0

    def look(
        self, now: Instant, own: OwnState, flown: WayOut | None, sent: tuple[float, float]
    ) -> list[Reason]:
        if flown is not None:
            self.seen.append((elapsed_s(flown.begin, now), flown.deviation_m(own)))
            self.courses += flown.orders is not None
        return super().look(now, own, flown, sent)


@pytest.mark.parametrize("intends", [False, True])
@pytest.mark.parametrize("vehicle", ["submarine", "boat"])
def test_a_bundled_vehicle_keeps_to_a_way_out_as_declared(vehicle: str, intends: bool) -> None:
    config, declared = configuration(vehicle, 2.0), TRACKING_M[vehicle]
    seen: list[tuple[float, float]] = []
    courses = 0
    for seed in range(8):
        rng = np.random.default_rng((3, seed))
        lanes = Lanes("stream" if seed % 2 else "convoy", rng)
        body = BadVehicle(config, rng, lanes.start_m(rng), "physics")
        plan = hostile(("random", "adversarial", "bow", "nan")[seed % 4], rng, config.vehicle.max_speed_mps)
        course = intending(rng, config.vehicle.max_speed_mps) if intends else None
        guard = Guard(config)
        watch = Watched(config)
        watch.seen = seen
        guard._watch = watch
        for step in range(100):
            now = instant(0.5 * step)
            own, tracks = body.measured(now), lanes.tracks(0.5 * step)
            beat = AutopilotHeartbeat(now, 1, 1, "ardupilot", "submarine", True, True, "GUIDED")
            wanted = plan(0.5 * step, own, tracks, now) if step else (0.0, 0.0, 0.0)
            told = None if course is None else course(now, own)
            flown = guard.check(now, own, beat, tracks, 1, wanted, told).velocity_ned_mps
            assert flown is not None
            body.send(0.5 * step, flown)
            for k in range(5):
                body.move(0.5 * step + 0.1 * k)
        courses += watch.courses
    assert len(seen) > 150
    assert (courses > 15) is intends
    off = np.array(seen)
    assert off[:, 1].max() <= declared
    assert (off[:, 1] <= declared * np.minimum(off[:, 0] / RAMP_S, 1.0) + BETWEEN_M).mean() > 0.999
    assert off[:, 1].max() > 0.2 * declared  # nor is it declared out of all proportion


def test_the_default_holds_for_either() -> None:
    assert GuardSection().tracking_error_m >= max(TRACKING_M.values())
