"""The paper's ship as `Arcs`: bounded speed and course noise, hull, position error.

    position(tau) = o0 + integral of (v + w_v)(cos(th + w_th), sin(th + w_th))      |w_v|, |w_th| bounded

    set = { antenna's motion } + { hull, turned by its heading error } + { disc of position error }

The antenna's motion is hull(t conv V, T conv V), V the velocity sector (Aumann): exact for noise that
varies at every instant.  It is the hull of two arcs around o0: ahead with radius r2 = T (v + w_v),
and the corners at r1 = t (v - w_v); where v < w_v the ship may drift astern and r1 = T (v - w_v) is an
arc too.  The hull is the hull of four arcs around the antenna, one per corner.
"""

import numpy as np

from companion.messages import BoolArray, FloatArray, IntArray, Tracks
from companion.reach.arcs import Arcs, ComplexArray, arcs_from_candidates
from companion.reach.support import known_turn

PAIRS = ((0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3))


def straight_arcs(tracks: Tracks) -> Arcs:
    """The sets of all contacts, to be scaled by r1 and r2 of `support.motion_radii`."""
    slow = tracks.sog_mps - tracks.speed_noise_mps
    fast = tracks.sog_mps + tracks.speed_noise_mps
    spread = tracks.course_noise_rad
    astern = slow < 0
    zero = np.zeros_like(slow)
    flank = np.where(astern, tangent(fast, zero, -slow, zero + np.pi, spread, 1.0), spread + np.pi / 2)
    rear = np.where(astern, np.pi - spread, np.pi)
    motion = tracks.cog_rad + np.stack((-rear, -flank, -spread, spread, flank, rear))

    length, azimuth = hull_corners(tracks)
    turn = known_turn(tracks.heading_error_rad)
    hull = [tracks.heading_rad + azimuth + bend for bend in (-turn, turn)]
    for k, m in PAIRS:
        is_first = length[k] >= length[m]
        big, small = np.where(is_first, length[k], length[m]), np.where(is_first, length[m], length[k])
        at_big = np.where(is_first, azimuth[k], azimuth[m])
        at_small = np.where(is_first, azimuth[m], azimuth[k])
        hull += [
            (tracks.heading_rad + tangent(big, at_big, small, at_small, turn, side))[None]
            for side in (-1.0, 1.0)
        ]
    candidates = np.concatenate((motion, *hull))
    angle = np.sort(wrap(candidates), axis=0)
    following = np.concatenate((angle[1:], angle[:1] + 2 * np.pi))
    middle = 0.5 * (angle + following)

    corner, state, hull_centre, hull_radius = _hull_piece(middle, tracks, length, azimuth)
    # position on the motion's boundary: which of its two arcs, and which end of it
    beside = wrap(middle - tracks.cog_rad)
    hand = np.where(beside >= 0, 1.0, -1.0)
    off = np.abs(beside)
    ahead = off <= flank
    behind = astern & ~ahead & (off > rear)
    on_front = off <= spread
    along = np.exp(1j * (tracks.cog_rad + hand * spread))
    across = np.exp(1j * (tracks.cog_rad - hand * spread))  # where astern, the far end of a negative ray
    far = np.where(ahead & ~on_front, along, 0.0)
    near = np.where(ahead | behind, 0.0, np.where(astern, across, along))
    region = np.where(on_front, 0, np.where(ahead, 1, np.where(behind, 5, 3)) + (hand > 0) * ~behind)
    # the motion's own breakpoints always stay: they keep neighbouring normals less than pi apart
    return arcs_from_candidates(
        angle,
        region * 12 + corner * 3 + state,
        (hull_centre, near.astype(np.complex128), far.astype(np.complex128)),
        (hull_radius + tracks.position_error_m, np.where(behind, -1.0, 0.0), np.where(on_front, 1.0, 0.0)),
    )


def hull_corners(tracks: Tracks) -> tuple[FloatArray, FloatArray]:
    """(4, n) distance from the antenna and azimuth from the heading of the four corners, clockwise."""
    ahead = np.stack((tracks.bow_m, -tracks.stern_m, -tracks.stern_m, tracks.bow_m))
    right = np.stack((tracks.starboard_m, tracks.starboard_m, -tracks.port_m, -tracks.port_m))
    return np.hypot(ahead, right), np.arctan2(right, ahead)


def tangent(
    big: FloatArray,
    at_big: FloatArray,
    small: FloatArray,
    at_small: FloatArray,
    half: FloatArray,
    side: float,
) -> FloatArray:
    """Normal of the edge from an arc's end to a smaller concentric arc; both +-`half` wide.

    From the end of the big arc the edge runs on toward `side` (+1 clockwise).  It touches the small
    circle where that is acos(small / big) further on, or meets the end of the small arc.
    """
    start = at_big + side * half
    ratio = np.divide(small, big, out=np.ones_like(big), where=big > 0)
    touch = np.arccos(np.minimum(ratio, 1.0))
    # angles run from `start` toward `side`, all in [0, 2 pi)
    middle = side * (at_small - start)
    near, far = np.remainder(middle - half, 2 * np.pi), np.remainder(middle + half, 2 * np.pi)
    is_touched = np.remainder(touch - near, 2 * np.pi) <= 2 * half
    run = np.where(far < touch, far, np.where(is_touched, touch, near))
    edge = small * np.exp(1j * (start + side * run)) - big * np.exp(1j * start)
    return np.asarray(np.angle(edge * (-1j * side)), dtype=np.float64)


def wrap(angle_rad: FloatArray) -> FloatArray:
    """The same directions in [-pi, pi)."""
    return np.asarray(np.remainder(angle_rad + np.pi, 2 * np.pi) - np.pi)


def _hull_piece(
    middle: FloatArray, tracks: Tracks, length: FloatArray, azimuth: FloatArray
) -> tuple[IntArray, IntArray, ComplexArray, FloatArray]:
    """Which corner (and which part of its arc) has the hull's support at the angles (L, n)."""
    turn = known_turn(tracks.heading_error_rad)
    beside = wrap(middle - tracks.heading_rad - azimuth[:, None])  # (4, L, n)
    reach = length[:, None] * np.cos(np.maximum(np.abs(beside) - turn, 0.0))
    corner = reach.argmax(axis=0)

    def chosen(values: FloatArray) -> FloatArray:
        picked: FloatArray = np.take_along_axis(np.broadcast_to(values, beside.shape), corner[None], axis=0)[
            0
        ]
        return picked

    off = chosen(beside)
    on_arc: BoolArray = np.abs(off) <= turn
    distance = chosen(length[:, None])
    end = tracks.heading_rad + chosen(azimuth[:, None]) + np.where(off > 0, turn, -turn)
    state = np.where(on_arc, 1, np.where(off > 0, 2, 0))
    centre: ComplexArray = np.where(on_arc, 0.0, distance * np.exp(1j * end))
    return corner, state, centre, np.where(on_arc, distance, 0.0)
