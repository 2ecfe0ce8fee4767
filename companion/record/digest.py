"""From a `Decision` to its record.  Pure."""

from dataclasses import fields
from hashlib import blake2b

import numpy as np

from companion.messages import Decision, Repulsion, Tracks
from companion.record.schema import (
    NEAREST_CONTACTS,
    ContactRecord,
    DecisionRecord,
    OutgoingRecord,
    TracksRecord,
)

_COLUMNS = tuple(f.name for f in fields(Tracks) if f.name not in ("revision", "names"))
_NO_REPULSION = b"no repulsion"


def tracks_record(tracks: Tracks) -> TracksRecord:
    """The contacts as plain columns."""
    columns = {name: getattr(tracks, name).tolist() for name in _COLUMNS}
    columns["spread_m"] = tracks.spread_m.tolist() if tracks.spread_m.size else []
    return TracksRecord(revision=tracks.revision, names=tracks.names, **columns)


class DecisionRecorder:
    """Numbers the decisions and turns each into its record.

    Tracks stay the same object while nothing is heard: their digest is taken once.
    """

    def __init__(self) -> None:
        self._number = 0
        self._tracks: Tracks | None = None
        self._tracks_digest = b""

    def record(self, decision: Decision) -> DecisionRecord:
        """The next record."""
        number = self._number
        self._number += 1
        return DecisionRecord(
            number=number,
            t_ns=decision.t,
            phase=decision.phase,
            status=decision.status,
            reasons=decision.reasons,
            tracks_revision=decision.tracks.revision,
            contacts=len(decision.tracks),
            nearest=_nearest(decision),
            digest=self._digest(decision.tracks, decision.repulsion),
            outgoing=[OutgoingRecord(kind=type(out).__name__, text=repr(out)) for out in decision.outgoing],
            counts=decision.counts,
            own=decision.own,
            attraction_mps=decision.attraction_mps,
            wanted_ned_mps=decision.wanted_ned_mps,
            setpoint=decision.setpoint,
            guard_changed=decision.guard_changed,
            system_id=decision.system_id,
            oldest_used_s=decision.oldest_used_s,
        )

    def _digest(self, tracks: Tracks, repulsion: Repulsion | None) -> str:
        if tracks is not self._tracks:
            whole = blake2b(digest_size=16)
            for name in _COLUMNS:
                whole.update(getattr(tracks, name).tobytes())
            whole.update("\n".join(tracks.names).encode())
            self._tracks, self._tracks_digest = tracks, whole.digest()
        both = blake2b(self._tracks_digest, digest_size=16)
        if repulsion is None:
            both.update(_NO_REPULSION)
        else:
            near = repulsion.nearest
            for array in (near.distance_m, near.away, repulsion.velocity, repulsion.from_network):
                both.update(array.tobytes())
        return both.hexdigest()


def _nearest(decision: Decision) -> list[ContactRecord]:
    if decision.repulsion is None:
        return []
    push, near = decision.repulsion, decision.repulsion.nearest
    rows = np.argsort(near.distance_m, kind="stable")[:NEAREST_CONTACTS]
    columns = zip(
        decision.tracks.mmsi[rows].tolist(),
        decision.tracks.age_s(decision.t)[rows].tolist(),
        near.distance_m[rows].tolist(),
        near.away[rows].tolist(),
        push.velocity[rows].tolist(),
        push.from_network[rows].tolist(),
        strict=True,
    )
    return [
        ContactRecord(
            mmsi=mmsi,
            age_s=age_s,
            distance_m=distance_m,
            away=(away[0], away[1]),
            repulsion_mps=(velocity[0], velocity[1]),
            from_network=network,
        )
        for mmsi, age_s, distance_m, away, velocity, network in columns
    ]
