"""The truth in the shape of `Tracks`, so that measuring uses the companion's own geometry."""

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from companion.instant import Instant
from companion.messages import FloatArray, Hull, IntArray, Model, Tracks

_Number = TypeVar("_Number", bound=np.generic)


def hull_array(hulls: Sequence[Hull]) -> FloatArray:
    """(n, 4) bow, stern, port, starboard in metres from the antenna."""
    return np.array([(h.bow_m, h.stern_m, h.port_m, h.starboard_m) for h in hulls]).reshape(-1, 4)


def true_tracks(
    t: Instant,
    *,
    mmsi: IntArray,
    position_m: FloatArray,
    course_rad: FloatArray,
    speed_mps: FloatArray,
    hulls: FloatArray,
    names: tuple[str, ...],
    heading_rad: FloatArray | None = None,
    heading_error_rad: FloatArray | None = None,
) -> Tracks:
    """Ships as they are at `t`: antennas (n, 2), hulls (n, 4); every bound is zero unless given.

    Rows must come in MMSI order.  A hull points along its course unless `heading_rad` is given.
    """
    n = len(mmsi)
    zero = np.zeros(n)
    bow, stern, port, starboard = hulls.T
    arrays = {
        "north_m": position_m[:, 0],
        "east_m": position_m[:, 1],
        "cog_rad": course_rad,
        "sog_mps": speed_mps,
        "heading_rad": course_rad if heading_rad is None else heading_rad,
        "bow_m": bow,
        "stern_m": stern,
        "port_m": port,
        "starboard_m": starboard,
        "position_error_m": zero,
        "speed_noise_mps": zero,
        "course_noise_rad": zero,
        "heading_error_rad": zero if heading_error_rad is None else heading_error_rad,
        "disc_speed_mps": zero,
        "top_speed_mps": zero,
        "validity_s": np.full(n, math.inf),
    }
    return Tracks(
        int(t),
        _frozen(mmsi),
        _frozen(np.full(n, t, dtype=np.int64)),
        **{key: _frozen(array) for key, array in arrays.items()},
        model=_frozen(np.full(n, Model.STRAIGHT, dtype=np.int64)),
        names=names,
    )


def _frozen(array: NDArray[_Number]) -> NDArray[_Number]:
    array = array.copy()
    array.setflags(write=False)
    return array
