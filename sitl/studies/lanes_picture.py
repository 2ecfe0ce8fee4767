"""The paper's two lanes as a picture and a truth, for studies that ask the guard without bytes."""

import math
from dataclasses import replace
from typing import Literal

import numpy as np

from companion import reach
from companion.instant import Instant, instant
from companion.messages import FloatArray, Tracks
from sitl.truth import true_tracks

TrafficKind = Literal["convoy", "stream"]
TRAFFICS: tuple[TrafficKind, ...] = ("convoy", "stream")
WIDTH_M, LANES_M = 230.0, (57.5, 172.5)
APART_M = 450.0  # bow to bow
SPEED_MPS, SPEED_NOISE_MPS, COURSE_NOISE_RAD = 5.0, 0.05, 0.01
HEADING_ERROR_RAD, POSITION_ERROR_M = 0.02, 1.0
HULL = (55.0, 20.0, 10.0, 15.0)  # bow, stern, port, starboard of the antenna
OLDEST_S = 250.0  # reports at the start of a trial
CONVOY, STREAM = 5, 14
VALIDITY_S = 1500.0
TURNED_RAD, FASTER = 0.6, (0.5, 1.6)  # what ships do that leave their bounds
AGAIN_S, AGAIN = 10.0, 12  # between their reports then, and how many


class Lanes:
    """Ships on both lanes, reported once (and again at `renewed_s`), each at a corner of its noise bounds.

    At `broken_s` every ship leaves what it declared: another course and another speed; from a few seconds
    later on it reports again, every ten seconds.  North is along the channel; its near edge lies at east 0.
    """

    def __init__(
        self,
        kind: TrafficKind,
        rng: np.random.Generator,
        renewed_s: float | None = None,
        broken_s: float | None = None,
    ) -> None:
        n = CONVOY if kind == "convoy" else STREAM
        self._renewed_s = math.inf if renewed_s is None else renewed_s
        sails = np.repeat((math.pi, 0.0), n)
        k = np.tile(np.arange(n), 2)
        # the middle of the row is abreast of the vehicle while the trial runs
        shift = rng.uniform(-APART_M / 2, APART_M / 2, 2)[np.repeat((0, 1), n)]
        along = ((n - 1) / 2 - k) * APART_M + shift - SPEED_MPS * rng.uniform(30.0, 250.0)
        east = np.repeat(LANES_M, n)
        self._at_zero = np.column_stack((along * np.cos(sails), east))
        corner = rng.choice((-1.0, 1.0), (2, 2 * n))
        self._course = sails + corner[0] * COURSE_NOISE_RAD
        self._speed = SPEED_MPS + corner[1] * SPEED_NOISE_MPS
        self._sails = sails
        self._mmsi = 230_000_001 + np.arange(2 * n)
        self._broken_s = self._heard_s = math.inf
        age = rng.uniform(0.0, OLDEST_S) + rng.uniform(0.0, 10.0, 2 * n)
        self._first = self._reported(-age, rng, 1)
        later = (0.0 if math.isinf(self._renewed_s) else self._renewed_s) - rng.uniform(0.1, 10.0, 2 * n)
        self._second = self._reported(later, rng, 2)
        if broken_s is not None:
            self._break(broken_s, rng)

    def tracks(self, t_s: float) -> Tracks:
        """What is known at `t_s`."""
        if t_s >= self._heard_s:
            return self._later[min(int((t_s - self._heard_s) / AGAIN_S), len(self._later) - 1)]
        return self._second if t_s >= self._renewed_s else self._first

    def has_broken(self, t_s: float) -> bool:
        """Whether the ships have left what they declared."""
        return t_s >= self._broken_s

    def truth(self, t_s: float) -> Tracks:
        """Where every hull is."""
        return true_tracks(
            instant(t_s),
            mmsi=self._mmsi,
            position_m=self._true_m(np.full(len(self._mmsi), t_s)),
            course_rad=self._course if not self.has_broken(t_s) else self._new_course,
            speed_mps=self._speed if not self.has_broken(t_s) else self._new_speed,
            hulls=np.tile(HULL, (len(self._mmsi), 1)),
            names=(),
        )

    def start_m(self, rng: np.random.Generator) -> FloatArray:
        """(2,) somewhere before, between or behind the lanes."""
        return np.array((rng.uniform(-200.0, 200.0), rng.uniform(-60.0, WIDTH_M + 60.0)))

    def beside_m(self, rng: np.random.Generator, delta_m: float, beyond_m: float) -> FloatArray:
        """(2,) a place up to `beyond_m` outside delta of a ship's set at the start, and of no other's."""
        sets = reach.at(self.tracks(0.0), Instant(0))
        while True:
            ship, angle = int(rng.integers(len(sets))), rng.uniform(-math.pi, math.pi)
            wanted = delta_m + rng.uniform(0.2, beyond_m)
            centre = self._at_zero[ship]
            low, high = 0.0, 1000.0
            for _ in range(40):
                middle = 0.5 * (low + high)
                place = centre + middle * np.array((math.cos(angle), math.sin(angle)))
                if sets.nearest(place).distance_m[ship] < wanted:
                    low = middle
                else:
                    high = middle
            if sets.nearest(place).distance_m.min() >= delta_m:
                return np.asarray(place)

    def _break(self, at_s: float, rng: np.random.Generator) -> None:
        n = len(self._mmsi)
        self._new_course = self._course + rng.uniform(-TURNED_RAD, TURNED_RAD, n)
        self._new_speed = self._speed * rng.uniform(*FASTER, n)
        self._heard_s = at_s + rng.uniform(2.0, AGAIN_S)
        self._broken_s = at_s
        self._later = [
            self._reported(np.full(n, self._heard_s + k * AGAIN_S), rng, 3 + k, broken=True)
            for k in range(AGAIN)
        ]

    def _true_m(self, t_s: FloatArray) -> FloatArray:
        """(n, 2) antennas at each ship's own time."""
        before = np.minimum(t_s, self._broken_s)
        place = self._at_zero + before[:, None] * _velocity(self._speed, self._course)
        if math.isfinite(self._broken_s):
            place = place + (t_s - before)[:, None] * _velocity(self._new_speed, self._new_course)
        return np.asarray(place)

    def _reported(
        self, at_s: FloatArray, rng: np.random.Generator, revision: int, *, broken: bool = False
    ) -> Tracks:
        """The picture after one report of each ship, measured at `at_s` (n,), off by all that is allowed."""
        angle = rng.uniform(-math.pi, math.pi, len(at_s))
        position = self._true_m(at_s) + POSITION_ERROR_M * np.column_stack((np.cos(angle), np.sin(angle)))
        n = len(at_s)

        def full(value: float) -> FloatArray:
            return np.full(n, value)

        base = true_tracks(
            Instant(0),
            mmsi=self._mmsi,
            position_m=position,
            course_rad=self._new_course if broken else self._sails,
            speed_mps=self._new_speed if broken else full(SPEED_MPS),
            hulls=np.tile(HULL, (n, 1)),
            names=(),
        )
        return replace(
            base,
            revision=revision,
            measured_at_ns=np.round(at_s * 1e9).astype(np.int64),
            position_error_m=full(POSITION_ERROR_M),
            speed_noise_mps=full(SPEED_NOISE_MPS),
            course_noise_rad=full(COURSE_NOISE_RAD),
            heading_error_rad=full(HEADING_ERROR_RAD),
            top_speed_mps=full(16.0),
            validity_s=full(VALIDITY_S),
        )


def _velocity(speed_mps: FloatArray, course_rad: FloatArray) -> FloatArray:
    """(n, 2) north and east."""
    return np.asarray(speed_mps[:, None] * np.column_stack((np.cos(course_rad), np.sin(course_rad))))
