"""What the chart shows and from where: chosen before anything is drawn.  Pure."""

from dataclasses import dataclass

import numpy as np

from companion import reach
from companion.geodesy import LocalFrame
from companion.instant import Instant
from companion.messages import BoolArray, FloatArray, Phase, Tracks
from sitl.measure import Course

ROUTE_POINTS = 80
LEAST_SPAN_M = 800.0


@dataclass(frozen=True, slots=True)
class Channel:
    """A shipping channel: a straight band through `point_m` (2,) along a course."""

    point_m: FloatArray
    along_rad: float
    width_m: float

    @property
    def along(self) -> FloatArray:
        """(2,) unit vector of its course."""
        return np.array((np.cos(self.along_rad), np.sin(self.along_rad)))


@dataclass(frozen=True, slots=True)
class Scene:
    """The stage: what is known before the run.  Positions (2,) are north, east in the sea's frame."""

    title: str
    frame: LocalFrame
    start_m: FloatArray
    goal_m: FloatArray
    goal_radius_m: float
    channel: Channel | None = None

    @property
    def runs_east_west(self) -> bool:
        """Whether the crossing lies more across the picture than up it: labels stand clear of it then."""
        north_m, east_m = np.abs(self.goal_m - self.start_m)
        return bool(east_m > north_m)


@dataclass(frozen=True, slots=True)
class Window:
    """The part of the sea in the picture, metres: north and east from - to."""

    north_m: tuple[float, float]
    east_m: tuple[float, float]

    @property
    def centre_m(self) -> FloatArray:
        """(2,) the middle."""
        return np.array((sum(self.north_m), sum(self.east_m))) / 2

    @property
    def half_m(self) -> FloatArray:
        """(2,) half its extent north and east."""
        return np.array((self.north_m[1] - self.north_m[0], self.east_m[1] - self.east_m[0])) / 2

    @property
    def radius_m(self) -> float:
        """From the middle to a corner."""
        return float(np.hypot(*self.half_m))

    def holds(self, points_m: FloatArray) -> BoolArray:
        """(...) whether points (..., 2) lie inside."""
        return np.asarray((np.abs(points_m - self.centre_m) <= self.half_m).all(axis=-1))

    def touches(self, outline_m: FloatArray) -> bool:
        """Whether the box around an outline (m, 2) overlaps the window."""
        low, high = outline_m.min(axis=0), outline_m.max(axis=0)
        return bool((np.abs((low + high) / 2 - self.centre_m) <= self.half_m + (high - low) / 2).all())

    def border_toward(self, point_m: FloatArray) -> FloatArray:
        """(2,) where the line from the middle to a point outside leaves the window."""
        offset = point_m - self.centre_m
        return np.asarray(self.centre_m + offset / max(float(np.max(np.abs(offset) / self.half_m)), 1e-9))


def window(course: Course, scene: Scene, aspect: float) -> Window:
    """Around the path, start and goal, with a margin; `aspect` is width over height."""
    points = np.vstack((course.position_m, scene.start_m, scene.goal_m))
    low, high = points.min(axis=0), points.max(axis=0)
    centre = (low + high) / 2
    span_north, span_east = np.maximum(high - low, LEAST_SPAN_M) * 1.16
    height = max(span_north, span_east / aspect)
    width = height * aspect
    return Window(
        (centre[0] - height / 2, centre[0] + height / 2), (centre[1] - width / 2, centre[1] + width / 2)
    )


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One moment: the vehicle, the true hulls and the sets the companion had, as far as in the window.

    `hulls_m` and `sets_m` are outlines (m, 2), north and east.  `everywhere` counts the sets that
    cover the whole window: ships silent for so long that they can be anywhere in it.
    """

    step: int
    since_start_s: float
    own_m: FloatArray
    truth: Tracks
    hulls_m: tuple[FloatArray, ...]
    sets_m: tuple[FloatArray, ...]
    everywhere: int


def snapshots(course: Course, view: Window) -> list[Snapshot]:
    """The beginning, the closest approach and the end of the crossing, and half-way between them."""
    under_way = np.flatnonzero([phase is Phase.CROSS for phase in course.phase])
    first, last = (under_way[0], under_way[-1]) if len(under_way) else (0, len(course) - 1)
    closest = course.to_sets.least()
    middle = (first + last) // 2 if closest is None else course.to_sets.step[closest]
    if not first < middle < last:
        middle = (first + last) // 2
    steps = np.unique([first, (first + middle) // 2, middle, (middle + last) // 2, last])
    return [snapshot(course, view, int(step)) for step in steps]


def snapshot(course: Course, view: Window, step: int) -> Snapshot:
    """The moment of one step."""
    t = course.instant(step)
    truth = course.truth(t)
    sets = reach.at(course.tracks[step], t)
    covers = _covers(sets, view, course.origin_m)
    return Snapshot(
        step=step,
        since_start_s=float(course.since_start_s[step]),
        own_m=course.position_m[step],
        truth=truth,
        hulls_m=hull_outlines(truth, t, view),
        sets_m=tuple(_outlines(sets, view, course.origin_m, ~covers)),
        everywhere=int(covers.sum()),
    )


def routes(course: Course, view: Window) -> list[FloatArray]:
    """(m, 2) the way of every ship that comes into the window, over the whole run."""
    when = np.linspace(0, len(course) - 1, ROUTE_POINTS).round().astype(int)
    ways: dict[int, list[tuple[float, float]]] = {}
    for step in np.unique(when):
        truth = course.truth(course.instant(int(step)))
        rows = zip(truth.mmsi.tolist(), truth.north_m.tolist(), truth.east_m.tolist(), strict=True)
        for mmsi, north_m, east_m in rows:
            ways.setdefault(mmsi, []).append((north_m, east_m))
    lines = [np.array(way) for way in ways.values() if len(way) > 1]
    return [line for line in lines if view.touches(line)]


def hull_outlines(truth: Tracks, t: Instant, view: Window) -> tuple[FloatArray, ...]:
    """Each hull in the window, seen from above and to scale: square stern, pointed bow.

    The bow tapers over the last eighth of the length, inside the rectangle of the report.  A hull
    whose heading nobody knows is drawn as the circle it lies in.
    """
    known = truth.heading_error_rad < np.pi
    shoulder = truth.bow_m - (truth.bow_m + truth.stern_m) / 8
    middle = (truth.starboard_m - truth.port_m) / 2
    ahead = np.stack((-truth.stern_m, shoulder, truth.bow_m, shoulder, -truth.stern_m), axis=1)
    right = np.stack((truth.starboard_m, truth.starboard_m, middle, -truth.port_m, -truth.port_m), axis=1)
    cos, sin = np.cos(truth.heading_rad)[:, None], np.sin(truth.heading_rad)[:, None]
    north = truth.north_m[:, None] + ahead * cos - right * sin
    east = truth.east_m[:, None] + ahead * sin + right * cos
    shaped = [hull for hull, sure in zip(np.stack((north, east), axis=2), known, strict=True) if sure]
    within = [hull for hull in shaped if view.touches(hull)]
    if not known.all():
        within += _outlines(reach.at(truth, t), view, np.zeros(2), ~known)
    return tuple(within)


def _outlines(
    sets: reach.ReachableSets, view: Window, origin_m: FloatArray, wanted: BoolArray
) -> list[FloatArray]:
    """Outlines of the wanted sets that reach into the window."""
    near = sets.nearest(view.centre_m - origin_m).distance_m < view.radius_m
    outlines = (sets.outline(int(row)) + origin_m for row in np.flatnonzero(near & wanted))
    return [outline for outline in outlines if view.touches(outline)]


def _covers(sets: reach.ReachableSets, view: Window, origin_m: FloatArray) -> BoolArray:
    """(n,) whether a set holds every corner of the window, and so, being convex, all of it."""
    signs = np.array(((1, 1), (1, -1), (-1, -1), (-1, 1)))
    distance_m, _ = sets.nearest_many(view.centre_m + signs * view.half_m - origin_m)
    return np.asarray((distance_m <= 0).all(axis=0))
