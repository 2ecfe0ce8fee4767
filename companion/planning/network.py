"""The learned repulsive field: one call of an ONNX network for all contacts.

A contact outside the ranges the network was made for, one whose course bounds nothing any more
(the disc model, or a tube that reaches beyond its validity), or one whose answer is not a number is
answered by the exact field and marked in `Repulsion.from_network`.  One so far away that its push is
nothing beside the attraction is answered by a box around its set (`far.py`) and costs no inference.

The session is deterministic: one thread, the CPU provider, nodes in sequence.
"""

import hashlib
from pathlib import Path

import numpy as np
import onnxruntime as ort

from companion.config import Config
from companion.errors import ModelError
from companion.instant import Instant
from companion.messages import BoolArray, FloatArray, Model, Nearest, Repulsion, Tracks
from companion.planning.far import Boxes, far_m
from companion.planning.field import ExactRepulsion
from companion.planning.model_file import (
    METADATA_KEY,
    REMEDY,
    Metadata,
    check_agreement,
    decode_metadata,
    read_bytes,
)
from companion.planning.rows import COLUMNS, ContactRows
from companion.reach.kernel import Kernel, nearest

AGE, UNTIL, SPEED, SPEED_NOISE = map(COLUMNS.index, ("age_s", "until_age_s", "speed_mps", "speed_noise_mps"))
INPUT = "contacts"
OUTPUTS = ["distance_m", "away", "repulsion"]
MOST_AT_ONCE = 1000  # rows whose intermediate numbers still fit the processor's cache


def open_session(content: bytes, origin: str) -> ort.InferenceSession:
    """A deterministic session; raises `ModelError` on anything that is not a usable ONNX file."""
    options = ort.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.enable_mem_reuse = False  # the numbers of a call fit the cache; looking for room costs more
    options.execution_mode = ort.ExecutionMode.ORT_SEQUENTIAL
    options.log_severity_level = 4
    try:
        return ort.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's own exception classes are private
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ModelError(
            f"repulsion.model = '{origin}': onnxruntime cannot read it ({reason}); {REMEDY}"
        ) from None


def infer(session: ort.InferenceSession, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distance (n,), away (n, 2) and repulsion (n, 2) of rows (n, 15): one call, or one per thousand rows."""
    parts = [
        session.run(OUTPUTS, {INPUT: rows[first : first + MOST_AT_ONCE]})
        for first in range(0, max(len(rows), 1), MOST_AT_ONCE)
    ]
    if len(parts) == 1:
        distance, away, velocity = parts[0]
    else:
        distance, away, velocity = (np.concatenate(part) for part in zip(*parts, strict=True))
    return distance, away, velocity


class NetworkRepulsion:
    """Repulsion from a network, its model checked against the configuration once, at start."""

    def __init__(
        self,
        session: ort.InferenceSession,
        metadata: Metadata,
        digest: str,
        exact: ExactRepulsion,
        far_from_m: float,
    ) -> None:
        self._session = session
        self.metadata = metadata
        self.digest = digest  # sha256 of the model file, hexadecimal
        self._exact = exact
        self._rows = ContactRows(circles=metadata.kind == "support")
        self._boxes, self._far_m = Boxes(), far_from_m
        self._low = np.array([i.low for i in metadata.inputs])
        self._high = np.array([i.high for i in metadata.inputs])

    @classmethod
    def load(cls, path_or_name: str | Path, config: Config, kernel: Kernel = nearest) -> "NetworkRepulsion":
        """Read a model file, or a packaged model by its name; raises `ModelError` with the remedy."""
        origin, content = read_bytes(path_or_name)
        session = open_session(content, origin)
        metadata = decode_metadata(session.get_modelmeta().custom_metadata_map.get(METADATA_KEY), origin)
        have = ([i.name for i in session.get_inputs()], [o.name for o in session.get_outputs()])
        if have != ([INPUT], OUTPUTS) or session.get_inputs()[0].shape[1:] != [len(COLUMNS)]:
            raise ModelError(f"repulsion.model = '{origin}': inputs or outputs are not ours; {REMEDY}")
        check_agreement(metadata, config, origin)
        digest = hashlib.sha256(content).hexdigest()
        return cls(session, metadata, digest, ExactRepulsion(config.field, kernel), far_m(config.field))

    def __call__(
        self, tracks: Tracks, now: Instant, until_age_s: FloatArray | float, position_m: FloatArray
    ) -> Repulsion:
        """Repulsion of every contact's tube [age, `until_age_s`] on a position (2,), or one each (n, 2)."""
        rows = self._rows.fill(tracks, now, until_age_s, position_m)
        learned = self.in_range(rows) & (tracks.model == Model.STRAIGHT)
        learned = learned & (np.maximum(tracks.age_s(now), until_age_s) <= tracks.validity_s)
        if not learned.any():
            return self._exact(tracks, now, until_age_s, position_m)
        answer = self._exact.from_nearest(self._boxes.nearest(tracks, now, until_age_s, position_m))
        distance, away, velocity = answer.nearest.distance_m, answer.nearest.away, answer.velocity
        near = np.flatnonzero(learned & (distance < self._far_m))
        distance[near], away[near], velocity[near] = self.run(rows[near])
        numbers = distance[near] + away[near].sum(axis=1) + velocity[near].sum(axis=1)
        learned[near[~np.isfinite(numbers)]] = False
        if not learned.all():
            exact = self._exact(tracks, now, until_age_s, position_m)
            distance = np.where(learned, distance, exact.nearest.distance_m)
            away = np.where(learned[:, None], away, exact.nearest.away)
            velocity = np.where(learned[:, None], velocity, exact.velocity)
        return Repulsion(Nearest(distance, away), velocity, learned)

    def in_range(self, rows: FloatArray) -> BoolArray:
        """(n,) whether a row lies in the ranges the network was made for.

        Beyond the ranges of its metadata, two conditions: a ship slower than its speed noise is outside
        (it may drift astern), and so is a tube that ends before it begins.
        """
        inside = (rows >= self._low) & (rows <= self._high)
        inside[:, SPEED] &= rows[:, SPEED] >= rows[:, SPEED_NOISE]
        inside[:, UNTIL] &= rows[:, UNTIL] >= rows[:, AGE]
        return np.asarray(inside.all(axis=1))

    def run(self, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The network itself: rows (n, 15) to distance (n,), away (n, 2), repulsion (n, 2)."""
        return infer(self._session, rows)
