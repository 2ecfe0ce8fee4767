"""The paper's ship, exact: bounded speed and course noise, hull, position error.

    position(tau) = o0 + integral of (v + w_v)(cos(th + w_th), sin(th + w_th))      |w_v|, |w_th| bounded

    set = { the antenna's motion } + { the hull, turned by its heading error } + { disc of position error }

The antenna's motion is hull(t conv V, T conv V), V the sector of velocities (Aumann): exact for noise
that varies at every instant.  It is the hull of two arcs around o0: one ahead with radius
r2 = T (v + w_v), and astern the corners at r1 = t (v - w_v), or where v < w_v, since the ship may then
drift astern, an arc of radius -r1, r1 = T (v - w_v).  The normals stay while time passes; only r1 and
r2 grow.
"""

from dataclasses import dataclass

import numpy as np

from companion.messages import BoolArray, FloatArray, IntArray, Tracks
from companion.reach.arc_sets import ArcSets
from companion.reach.arcs import Affine, Arcs, Points
from companion.reach.hull import Corners, tangent, with_hull, wrap
from companion.reach.kernel import Kernel

# parts of the motion's boundary, clockwise from the stern
ASTERN, PORT_NEAR, PORT_FAR, AHEAD, STARBOARD_FAR, STARBOARD_NEAR = range(6)


@dataclass(frozen=True, slots=True)
class SectorMotion:
    """Where the antenna's motion changes its boundary: half angles from the course, (n,) each.

    Ahead of `spread` its boundary is the far arc, up to `flank` the far corner, up to `rear` the near
    corner, and beyond, where the ship may drift astern, the near arc.
    """

    course: FloatArray
    spread: FloatArray
    flank: FloatArray
    rear: FloatArray
    drifts: BoolArray

    @classmethod
    def of(cls, tracks: Tracks) -> "SectorMotion":
        """The motion's shape; its size is r1 and r2."""
        slow = tracks.sog_mps - tracks.speed_noise_mps
        fast = tracks.sog_mps + tracks.speed_noise_mps
        spread, drifts = tracks.course_noise_rad, slow < 0
        edge = tangent(
            fast, np.zeros_like(fast), np.maximum(-slow, 0.0), np.full_like(fast, np.pi), spread, 1.0
        )
        flank = np.where(drifts, edge, spread + np.pi / 2)
        rear = np.where(drifts, np.maximum(np.pi - spread, flank), np.pi)
        return cls(tracks.cog_rad, spread, flank, rear, drifts)

    def breaks(self) -> FloatArray:
        """(6, n) angles of its breakpoints."""
        beside = np.stack((-self.rear, -self.flank, -self.spread, self.spread, self.flank, self.rear))
        return self.course + beside

    def part(self, angle_rad: FloatArray) -> IntArray:
        """Which part of the boundary has the support in the directions (L, n)."""
        beside = wrap(angle_rad - self.course)
        off = np.abs(beside)
        from_ahead = (off > self.spread).astype(np.int64) + (off > self.flank) + (off > self.rear)
        return np.where(beside < 0, AHEAD - from_ahead, AHEAD + from_ahead) % 6

    def pieces(self, part: IntArray) -> tuple[Points, Affine]:
        """Centres and radii of the parts (J, n), per metre of r1 and r2."""
        port = np.exp(1j * (self.course - self.spread))
        starboard = np.exp(1j * (self.course + self.spread))
        # a negative r1 turns a corner to the other side
        port_near = np.where(self.drifts, starboard, port)
        starboard_near = np.where(self.drifts, port, starboard)
        zero = np.zeros_like(port)
        rows = np.arange(len(port))
        near = np.stack((zero, port_near, zero, zero, zero, starboard_near))[part, rows]
        far = np.stack((zero, zero, port, zero, starboard, zero))[part, rows]
        nothing = np.zeros(part.shape)
        arc_near, arc_far = np.where(part == ASTERN, -1.0, 0.0), np.where(part == AHEAD, 1.0, 0.0)
        return (nothing.astype(np.complex128), near, far), (nothing, arc_near, arc_far)


@dataclass(frozen=True, slots=True)
class StraightShapes:
    """The sets of straight contacts but for the distances run."""

    arcs: Arcs
    slow_mps: FloatArray  # least and greatest speed along a ray; negative is astern
    fast_mps: FloatArray
    kernel: Kernel

    def between(self, age_s: FloatArray, until_s: FloatArray) -> ArcSets:
        """The tube from `age_s` to `until_s`."""
        near = np.minimum(age_s * self.slow_mps, until_s * self.slow_mps)
        return ArcSets(self.arcs, near, until_s * self.fast_mps, self.kernel)


def straight_shapes(tracks: Tracks, kernel: Kernel) -> StraightShapes:
    """What a straight contact's report says about its set."""
    sets = with_hull(SectorMotion.of(tracks), Corners.of(tracks), tracks.position_error_m)
    slow, fast = tracks.sog_mps - tracks.speed_noise_mps, tracks.sog_mps + tracks.speed_noise_mps
    return StraightShapes(sets, slow, fast, kernel)
