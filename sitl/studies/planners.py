"""The planners of the tables, by name, each driving many vehicles at once.

The potential-field planners are `companion.planning.steering` as it runs on the board.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from companion.instant import Instant
from companion.messages import FloatArray, IntArray, Phase, Tracks
from companion.planning.field import ExactRepulsion
from companion.planning.network import NetworkRepulsion
from companion.planning.rehearsal import Rehearsal
from companion.planning.steering import Steering
from companion.reach import choose_kernel
from companion.reach.shapes import only
from sitl.studies.case import Crossing
from sitl.studies.orca import Orca
from sitl.studies.search import Search
from sitl.studies.ships import without_uncertainty
from sitl.studies.vehicles import shortened
from sitl.studies.wish import Planner, Wish

NOTICED = 0.01  # of full speed: a weaker push did not steer


@dataclass(frozen=True, slots=True)
class FieldPlanner:
    """The steering of the product: attraction, repulsion, horizon and the pull astern."""

    steering: Steering
    tracks: Tracks
    vehicles: int
    goal_m: FloatArray  # (2,)
    max_speed_mps: float

    def only(self, vehicles: IntArray) -> "FieldPlanner":
        """For some of the vehicles."""
        k = len(self.tracks) // self.vehicles
        rows = (vehicles[:, None] * k + np.arange(k)).ravel()
        return replace(self, tracks=only(self.tracks, rows), vehicles=len(vehicles))

    def wish(self, now: Instant, position_m: FloatArray, velocity_mps: FloatArray) -> Wish:  # noqa: ARG002
        """See `Planner`; a point needs no velocity of its own."""
        m = len(position_m)
        k = len(self.tracks) // m
        push = self.steering.push(self.tracks, now, np.repeat(position_m, k, axis=0), self.goal_m)
        pull = self.steering.pull(position_m, self.goal_m, Phase.CROSS)
        u = self.steering.horizontal(self.tracks, pull, push)
        strength = np.hypot(push.velocity[:, 0], push.velocity[:, 1]).reshape(m, k)
        steered = strength.max(axis=1) > NOTICED * self.max_speed_mps
        return Wish(shortened(u, self.max_speed_mps), steered)


@dataclass(frozen=True, slots=True)
class Entry:
    """A row of the tables: what it is called, whether it claims safety, and how it is made."""

    title: str
    claims_safety: bool
    make: Callable[[Crossing, Tracks, int, str], Planner]


def planner_tables(case: Crossing, *, improved: bool) -> dict[str, object]:
    """The [planner] table: the improved planner, or the paper's under the chosen reading."""
    per_ship = case.readings.horizon == "per-ship"
    if improved:
        return {"horizon": "clearing"}
    return {"horizon": "clearing", "astern_gain": 0.0} if per_ship else {"horizon": "paper"}


def field_planner(
    case: Crossing,
    tracks: Tracks,
    vehicles: int,
    kernel: str,
    *,
    improved: bool,
    network: bool,
) -> FieldPlanner:
    """Steering on these tracks by the network or by the exact sets."""
    slices = case.readings.horizon == "slice" and not improved
    settings = case.settings(planner_tables(case, improved=improved), slices=slices)
    exact = ExactRepulsion(
        settings.field, choose_kernel("numba" if kernel == "numba" else "numpy"), case.singular_gap_m
    )
    field = NetworkRepulsion.load(case.model, settings) if network else exact
    return FieldPlanner(
        Steering(settings, field), tracks, vehicles, np.array(case.goal_m), case.max_speed_mps
    )


def _paper(case: Crossing, tracks: Tracks, vehicles: int, kernel: str) -> Planner:
    return field_planner(case, tracks, vehicles, kernel, improved=False, network=False)


def _network(case: Crossing, tracks: Tracks, vehicles: int, kernel: str) -> Planner:
    return field_planner(case, tracks, vehicles, kernel, improved=False, network=True)


def _careless(case: Crossing, tracks: Tracks, vehicles: int, kernel: str) -> Planner:
    return field_planner(case, without_uncertainty(tracks), vehicles, kernel, improved=False, network=False)


def _improved(case: Crossing, tracks: Tracks, vehicles: int, kernel: str) -> Planner:
    return field_planner(case, tracks, vehicles, kernel, improved=True, network=True)


def _improved_exact(case: Crossing, tracks: Tracks, vehicles: int, kernel: str) -> Planner:
    return field_planner(case, tracks, vehicles, kernel, improved=True, network=False)


def _rehearsed(case: Crossing, tracks: Tracks, vehicles: int, kernel: str) -> Planner:
    from sitl.studies.gated import Gated  # noqa: PLC0415 - it is made of this module's planner

    planner = field_planner(case, tracks, vehicles, kernel, improved=True, network=True)
    settings = case.settings(planner_tables(case, improved=True))
    compute = choose_kernel("numba" if kernel == "numba" else "numpy")
    exact = Steering(settings, ExactRepulsion(settings.field, compute, case.singular_gap_m))
    post = np.tile(case.start_m, (vehicles, 1))
    return Gated(planner, Rehearsal(settings, exact, compute), post, np.zeros(vehicles, dtype=np.bool_))


def _orca(case: Crossing, tracks: Tracks, vehicles: int, kernel: str) -> Planner:  # noqa: ARG001
    return Orca.of(case, tracks, vehicles)


def _search(case: Crossing, tracks: Tracks, vehicles: int, kernel: str) -> Planner:
    return Search.of(case, tracks, vehicles, kernel)


PLANNERS: dict[str, Entry] = {
    "network": Entry("network", True, _network),
    "exact": Entry("exact", True, _paper),
    "no-uncertainty": Entry("no uncertainty", False, _careless),
    "improved": Entry("improved", True, _improved),
    "improved-exact": Entry("improved, exact", True, _improved_exact),
    "rehearsed": Entry("improved, rehearsed", True, _rehearsed),
    "orca": Entry("ORCA", False, _orca),
    "search": Entry("search", True, _search),
}
