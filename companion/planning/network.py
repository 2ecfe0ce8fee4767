"""The learned repulsive field: one call of an ONNX network for all contacts of a kind.

A contact outside the ranges the network was made for, one whose course bounds nothing any more
(the disc model, or a tube that reaches beyond its validity), or one whose answer is not a number is
answered by the exact field and marked in `Repulsion.from_network`.  One so far away that its push is
nothing beside the attraction is answered by a box around its set (`far.py`) and costs no inference.

The session is deterministic: one thread, the CPU provider, nodes in sequence.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnxruntime as ort

from companion.config import Config
from companion.errors import ModelError
from companion.instant import Instant
from companion.messages import BoolArray, FloatArray, Model, Nearest, Repulsion, Tracks
from companion.planning.certificate import refuse_another
from companion.planning.far import Boxes, far_m
from companion.planning.field import ExactRepulsion
from companion.planning.model_file import (
    KEY,
    METADATA_KEY,
    REMEDY,
    Metadata,
    check_agreement,
    decode_metadata,
    read_bytes,
)
from companion.planning.rows import COLUMNS, TURNING_COLUMNS, ContactRows
from companion.reach.kernel import Kernel, nearest
from companion.reach.shapes import only

SPEED, AGE, UNTIL, SPEED_NOISE, COURSE_NOISE = (
    COLUMNS.index(name)
    for name in (
        "speed_mps",
        "age_s",
        "until_age_s",
        "speed_noise_mps",
        "course_noise_rad",
    )
)
Answer = tuple[FloatArray, FloatArray, FloatArray]  # distance (n,), away (n, 2), repulsion (n, 2)
TURNING_KEY = "repulsion.turning_model"
INPUT = "contacts"
OUTPUTS = ["distance_m", "away", "repulsion"]
MOST_AT_ONCE = {len(COLUMNS): 1000, len(TURNING_COLUMNS): 10}  # rows whose numbers still fit the cache


def open_session(content: bytes, origin: str, key: str = KEY) -> ort.InferenceSession:
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
        raise ModelError(f"{key} = '{origin}': onnxruntime cannot read it ({reason}); {REMEDY}") from None


def infer(session: ort.InferenceSession, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distance (n,), away (n, 2) and repulsion (n, 2) of rows; one call for as many as fit the cache."""
    step = MOST_AT_ONCE[rows.shape[1]]
    parts = [
        session.run(OUTPUTS, {INPUT: rows[first : first + step]})
        for first in range(0, max(len(rows), 1), step)
    ]
    if len(parts) == 1:
        distance, away, velocity = parts[0]
    else:
        distance, away, velocity = (np.concatenate(part) for part in zip(*parts, strict=True))
    return distance, away, velocity


@dataclass(frozen=True, slots=True)
class Network:
    """A loaded model that was checked against the configuration."""

    session: ort.InferenceSession
    metadata: Metadata
    digest: str  # sha256 of the file, hexadecimal
    low: FloatArray  # (columns,) the ranges it was made for
    high: FloatArray

    @classmethod
    def load(cls, path_or_name: str | Path, config: Config, key: str = KEY) -> "Network":
        """Read a model file, or a packaged model by its name; `key` is what an error names."""
        origin, content = read_bytes(path_or_name, key=key)
        refuse_another(path_or_name, content, key)
        session = open_session(content, origin, key)
        text = session.get_modelmeta().custom_metadata_map.get(METADATA_KEY)
        metadata = decode_metadata(text, origin, key)
        have = ([i.name for i in session.get_inputs()], [o.name for o in session.get_outputs()])
        if have != ([INPUT], OUTPUTS) or session.get_inputs()[0].shape[1:] != [len(metadata.inputs)]:
            raise ModelError(f"{key} = '{origin}': inputs or outputs are not ours; {REMEDY}")
        if metadata.turns() != (key == TURNING_KEY):
            verb = "turn" if metadata.turns() else "keep their course"
            raise ModelError(f"{key} = '{origin}': made for ships that {verb}; {REMEDY}")
        check_agreement(metadata, config, origin, key)
        low, high = (np.array([getattr(i, end) for i in metadata.inputs]) for end in ("low", "high"))
        return cls(session, metadata, hashlib.sha256(content).hexdigest(), low, high)

    def in_range(self, rows: FloatArray) -> BoolArray:
        """(n,) whether a row lies in the ranges the network was made for.

        Beyond the ranges of its metadata, some conditions: a ship slower than its speed noise is outside
        (it may drift astern), so is a tube that ends before it begins, and so is a turn whose courses
        until the end may differ by more than half a circle.
        """
        inside = (rows >= self.low) & (rows <= self.high)
        inside[:, SPEED] &= rows[:, SPEED] >= rows[:, SPEED_NOISE]
        inside[:, UNTIL] &= rows[:, UNTIL] >= rows[:, AGE]
        if self.metadata.turns():
            rate, error = np.abs(rows[:, -2]), rows[:, -1]
            turned = np.ceil(rows[:, UNTIL]) * (rate + error + np.maximum(error - rate, 0.0))
            inside[:, COURSE_NOISE] &= turned + 2 * rows[:, COURSE_NOISE] <= np.pi
        return np.asarray(inside.all(axis=1))

    def run(self, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The network itself: rows to distance (n,), away (n, 2), repulsion (n, 2)."""
        return infer(self.session, rows)


class NetworkRepulsion:
    """Repulsion from networks, their models checked against the configuration once, at start.

    One network answers for ships that keep their course, another, if configured, for ships that turn.
    """

    def __init__(
        self, network: Network, turning: Network | None, exact: ExactRepulsion, far_from_m: float
    ) -> None:
        self.network = network
        self.turning = turning
        self._exact = exact
        self._rows = ContactRows(circles=network.metadata.kind == "support")
        self._boxes, self._far_m = Boxes(), far_from_m
        self._rest: tuple[Tracks, BoolArray, Tracks] | None = None
        self.metadata, self.in_range, self.run = network.metadata, network.in_range, network.run
        self.digest, self.turning_digest = network.digest, turning.digest if turning else ""

    @classmethod
    def load(cls, path_or_name: str | Path, config: Config, kernel: Kernel = nearest) -> "NetworkRepulsion":
        """The model given, and the configuration's turning model; raises `ModelError` with the remedy.

        What falls back to the exact sets is computed by `kernel`.
        """
        network, name = Network.load(path_or_name, config), config.repulsion.turning_model
        turning = Network.load(name, config, TURNING_KEY) if name else None
        return cls(network, turning, ExactRepulsion(config.field, kernel), far_m(config.field))

    def __call__(
        self, tracks: Tracks, now: Instant, until_age_s: FloatArray | float, position_m: FloatArray
    ) -> Repulsion:
        """Repulsion of every contact's tube [age, `until_age_s`] on a position (2,), or one each (n, 2)."""
        rows = self._rows.fill(tracks, now, until_age_s, position_m)
        valid = rows[:, UNTIL] <= tracks.validity_s
        straight = valid & (tracks.model == Model.STRAIGHT) & self.in_range(rows)
        turning = valid & (tracks.model == Model.TURNING) & (self.turning is not None)
        numbers: Answer = np.empty(len(rows)), np.empty((len(rows), 2)), np.empty((len(rows), 2))
        if straight.any():
            boxes = self._exact.from_nearest(self._boxes.nearest(tracks, now, until_age_s, position_m))
            numbers = boxes.nearest.distance_m, boxes.nearest.away, boxes.velocity
            near = straight & (numbers[0] < self._far_m)
            _put(numbers, near, self.run(rows[near]))
        if turning.any():
            turning = self._turn(numbers, turning, rows, tracks)
        distance, away, velocity = numbers
        learned = straight | turning
        sums = distance[learned] + away[learned].sum(axis=1) + velocity[learned].sum(axis=1)
        learned[learned] = np.isfinite(sums)
        if not learned.all():
            _put(numbers, ~learned, self._exactly(tracks, now, until_age_s, position_m, ~learned))
        return Repulsion(Nearest(distance, away), velocity, learned)

    def _turn(self, numbers: Answer, asked: BoolArray, rows: FloatArray, tracks: Tracks) -> BoolArray:
        """Put in the turning network's answers; returns for which rows it has one."""
        assert self.turning is not None
        turns = np.column_stack(
            (rows[asked], tracks.turn_rate_radps[asked], tracks.turn_rate_error_radps[asked])
        )
        inside = self.turning.in_range(turns)
        answered = asked.copy()
        answered[asked] = inside
        if inside.any():
            _put(numbers, answered, self.turning.run(turns[inside]))
        return answered

    def _exactly(
        self,
        tracks: Tracks,
        now: Instant,
        until_age_s: FloatArray | float,
        position_m: FloatArray,
        rest: BoolArray,
    ) -> Answer:
        """The exact field for some rows; their tracks are kept, as their sets are prepared once a report."""
        if self._rest is None or self._rest[0] is not tracks or (self._rest[1] != rest).any():
            kept = tracks if rest.all() else only(tracks, np.flatnonzero(rest))
            self._rest = tracks, rest, kept
        until = until_age_s[rest] if isinstance(until_age_s, np.ndarray) and until_age_s.ndim else until_age_s
        at = position_m[rest] if position_m.ndim == 2 else position_m
        exact = self._exact(self._rest[2], now, until, at)
        return exact.nearest.distance_m, exact.nearest.away, exact.velocity


def _put(numbers: Answer, where: BoolArray, found: Answer) -> None:
    for column, values in zip(numbers, found, strict=True):
        column[where] = values
