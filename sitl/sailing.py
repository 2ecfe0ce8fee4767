"""Ships' motion when speed and course are piecewise constant: integrated exactly, a formula in time."""

import numpy as np

from companion.messages import FloatArray


class Sailing:
    """`speed_mps` and `course_rad` (n, k) hold `hold_s` each, one after the other; the last for ever."""

    def __init__(self, hold_s: float, speed_mps: FloatArray, course_rad: FloatArray) -> None:
        self._hold_s = hold_s
        self._speed = speed_mps
        self._course = course_rad
        self._velocity = speed_mps[..., None] * np.stack((np.cos(course_rad), np.sin(course_rad)), axis=-1)
        run = np.cumsum(self._velocity[:, :-1] * hold_s, axis=1)
        self._run = np.concatenate((np.zeros((len(run), 1, 2)), run), axis=1)

    def run_m(self, since_s: float) -> FloatArray:
        """(n, 2) the way made in the first `since_s`, north and east."""
        k, into_s = self._slot(since_s)
        run: FloatArray = self._run[:, k] + self._velocity[:, k] * into_s
        return run

    def speed_mps(self, since_s: float) -> FloatArray:
        """(n,) the speed at that time."""
        speed: FloatArray = self._speed[:, self._slot(since_s)[0]]
        return speed

    def course_rad(self, since_s: float) -> FloatArray:
        """(n,) the course at that time."""
        course: FloatArray = self._course[:, self._slot(since_s)[0]]
        return course

    def _slot(self, since_s: float) -> tuple[int, float]:
        since = max(since_s, 0.0)
        k = min(int(since // self._hold_s), self._velocity.shape[1] - 1)
        return k, since - k * self._hold_s
