"""The picture as a table for people: one line per row of the tracks, nearest set first."""

import math
from dataclasses import dataclass

import numpy as np

from companion import reach
from companion.geodesy import LocalFrame
from companion.instant import Instant
from companion.messages import FloatArray, Model, OwnPosition, Tracks
from companion.picture.ageing import AgeState, age_states
from companion.picture.closest import approaches
from companion.picture.picture import Picture

DIRECTIONS = 180
_ANGLES = np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
_UNIT = np.column_stack((np.cos(_ANGLES), np.sin(_ANGLES)))


@dataclass(frozen=True, slots=True)
class Line:
    """One contact now."""

    mmsi: int
    name: str
    age_s: float
    state: AgeState
    range_m: float
    bearing_deg: float
    sog_mps: float
    cog_deg: float | None  # None where no course is known
    cpa_m: float
    tcpa_s: float
    distance_m: float  # from us to the nearest point of its set, negative inside
    area_km2: float  # of its set, hull and position error included
    sources: tuple[str, ...]


def lines(picture: Picture, tracks: Tracks, now: Instant, own: OwnPosition, frame: LocalFrame) -> list[Line]:
    """All contacts, those whose sets are nearest first."""
    if not len(tracks):
        return []
    here = np.array(frame.to_local(own.latitude_deg, own.longitude_deg))
    velocity = np.array(own.velocity_ned_mps[:2] if own.velocity_ned_mps else (0.0, 0.0))
    approach = approaches(tracks, now, own.stamp, here, velocity)
    sets = reach.at(tracks, now)
    distance = sets.nearest(here + velocity * ((now - own.stamp) * 1e-9)).distance_m
    area = areas_m2(sets.support(_UNIT) - _offset_m(tracks))
    age, states = tracks.age_s(now), age_states(tracks, now)
    return [
        Line(
            mmsi=int(tracks.mmsi[i]),
            name=tracks.names[i] if tracks.names else "",
            age_s=float(age[i]),
            state=states[i],
            range_m=float(approach.range_m[i]),
            bearing_deg=math.degrees(approach.bearing_rad[i]),
            sog_mps=float(tracks.sog_mps[i]),
            cog_deg=None
            if tracks.model[i] == Model.DISC or tracks.sog_mps[i] == 0.0
            else math.degrees(tracks.cog_rad[i]),
            cpa_m=float(approach.cpa_m[i]),
            tcpa_s=float(approach.tcpa_s[i]),
            distance_m=float(distance[i]),
            area_km2=float(area[i]) / 1e6,
            sources=tuple(sorted(s.value for s in picture.heard_from(int(tracks.mmsi[i])))),
        )
        for i in np.argsort(distance, kind="stable")
    ]


def _offset_m(tracks: Tracks) -> FloatArray:
    return np.outer(tracks.north_m, _UNIT[:, 0]) + np.outer(tracks.east_m, _UNIT[:, 1])


def areas_m2(support: FloatArray) -> FloatArray:
    """(n,) areas of the polygons tangent to convex sets in `DIRECTIONS` directions; support (n, 180).

    Polygons around the sets: never too small, for rounded sets 0.01 % too large.
    """
    step = 2 * np.pi / DIRECTIONS
    before, behind = np.roll(support, 1, axis=1), np.roll(support, -1, axis=1)
    edge = (before + behind - 2 * support * math.cos(step)) / math.sin(step)
    return np.asarray((support * edge).sum(axis=1) / 2)
