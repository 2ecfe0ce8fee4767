"""The certificate beside a model, and its check: seconds, no torch, another method than its maker.

A turning network's proof is in `turning_proof`.  Of a straight ship's network is proven, for every course
noise w in the model's range and every grid direction b:

    0 <= N^(w) - cos(max(|b| - w, 0)) <= eps

N^ is the learned network, the cosine the true support per metre of reach.  The set's support is
that times the reach A = until * (v + w_v) (or age * (v - w_v)), plus hull and position error, which
the graph has in closed form; so over the whole stated domain the learned support is nowhere below
the true one and nowhere more than A * eps above.  Each support value bounds the distance from below:
the network never claims more distance than there is, at any position.

The maker encloses slopes by interval arithmetic and halves cells.  Here: a fixed fine grid and
Taylor's formula with one bound of the second derivative for all of it,

    |f(w) - f(m) - f'(m) (w - m)| <= max|f''| (w - m)^2 / 2,      f = N^ - N
"""

import hashlib
import math
from pathlib import Path

import msgspec
import numpy as np

from companion.errors import ModelError
from companion.messages import FloatArray
from companion.planning import turning_proof
from companion.planning.model_file import METADATA_KEY, TURNING, decode_metadata, read_bytes
from companion.planning.onnx_weights import float_constants, metadata_text

SCHEMA = 1
SUFFIX = ".certificate.json"
POINTS = 16_384
TANH_CURVATURE = 4 / (3 * math.sqrt(3))  # max |tanh''|
ROUNDING = 1e-12
REMEDY = "run `companion certify MODEL` where the training extra is installed"


class Certificate(msgspec.Struct, frozen=True, kw_only=True):
    """What is claimed of one model file, and how it was found.

    `grid` and `course_noise_max_rad` are a straight ship's network's; a turning one has neither.
    """

    schema: int
    model: str
    model_sha256: str
    property: str
    domain: dict[str, tuple[float, float]]
    conditions: tuple[str, ...]
    grid: int = 0
    course_noise_max_rad: float = 0.0
    eps_per_metre_of_reach: float
    eps_m: dict[str, float]  # for stated parts of the domain
    rounding: str
    method: str
    cells: int
    seal: str = ""  # sha256 of all the above

    def sealed(self) -> "Certificate":
        """The same with its seal."""
        return msgspec.structs.replace(self, seal=self._digest())

    def is_sealed(self) -> bool:
        """Whether nothing was changed since."""
        return self.seal == self._digest()

    def _digest(self) -> str:
        blank = msgspec.structs.replace(self, seal="")
        return hashlib.sha256(msgspec.json.encode(blank, order="sorted")).hexdigest()


def refuse_another(path_or_name: str | Path, content: bytes, key: str) -> None:
    """Raise `ModelError` where a certificate lies beside the model and is of another file: one bit tells."""
    try:
        certificate = _read(path_or_name, str(path_or_name))
    except ModelError:
        return  # none, or none to read: `check` says so to whoever asks for one
    if hashlib.sha256(content).hexdigest() != certificate.model_sha256:
        raise ModelError(
            f"{key} = '{path_or_name}': damaged or replaced, for the certificate beside it is of another "
            f"file; install it again, or {REMEDY}"
        )


def check(path_or_name: str | Path) -> Certificate:
    """Prove a model's certificate again; raises `ModelError` saying what is wrong with it."""
    origin, content = read_bytes(path_or_name)
    certificate = _read(path_or_name, origin)
    if not certificate.is_sealed():
        raise ModelError(f"the certificate of '{origin}' was changed after it was made; {REMEDY}")
    if hashlib.sha256(content).hexdigest() != certificate.model_sha256:
        raise ModelError(f"the certificate of '{origin}' is for another file than this model; {REMEDY}")
    try:
        metadata = decode_metadata(metadata_text(content, METADATA_KEY), origin)
        prove = _prove_turning if metadata.kind == TURNING else _prove_support
        flaw = prove(content, certificate)
    except (ValueError, KeyError) as error:
        raise ModelError(f"'{origin}' has no learned support to check ({error}); {REMEDY}") from None
    if {i.name: (i.low, i.high) for i in metadata.inputs} != certificate.domain or (
        metadata.kind != TURNING
        and certificate.course_noise_max_rad < metadata.range_of("course_noise_rad").high
    ):
        raise ModelError(f"the certificate of '{origin}' is for another domain than the model's; {REMEDY}")
    if flaw:
        raise ModelError(f"the certificate of '{origin}' does not hold: {flaw}; {REMEDY}")
    return certificate


def _prove_support(content: bytes, certificate: Certificate) -> str:
    """What is wrong, or nothing."""
    low, high = enclose(content, certificate)
    eps = certificate.eps_per_metre_of_reach
    if low >= 0 and high <= eps:
        return ""
    found = f"[{low:.3g}, {high:.3g}], not in [0, {eps:.3g}]"
    return f"learned minus true support, per metre of reach, is in {found}"


def _prove_turning(content: bytes, certificate: Certificate) -> str:
    """What is wrong, or nothing; the excess ahead counts twice, once for either end of the courses."""
    low, high, most_above = turning_proof.enclose(content)
    eps = (certificate.eps_per_metre_of_reach - most_above) / 2
    if low < 0 or not high <= eps:
        return f"learned minus true mean cosine is in [{low:.3g}, {high:.3g}], not in [0, {eps:.3g}]"
    if not high <= most_above:
        return f"the graph takes {most_above:.3g} off astern, less than the excess {high:.3g} there may be"
    return ""


def enclose(content: bytes, certificate: Certificate) -> tuple[float, float]:
    """Bounds of learned minus true support per metre of reach, over all directions and noises."""
    constants = float_constants(content)
    count = sum(1 for name in constants if name.startswith("weight"))
    layers = [(constants[f"weight{i}"], constants[f"bias{i}"].ravel()) for i in range(count)]
    widest, k = certificate.course_noise_max_rad, certificate.grid
    if not layers or layers[-1][0].shape[1] != k:
        raise ValueError(f"weights for {k} directions not found")
    half = widest / POINTS / 2
    middle = (2 * np.arange(POINTS) + 1) * half
    angle = np.abs(np.remainder(2 * np.pi * np.arange(k) / k + np.pi, 2 * np.pi) - np.pi)
    beyond = np.maximum(angle - middle[:, None], 0.0)

    value, slope = 2 * middle[:, None] / widest - 1, np.full((POINTS, 1), 2 / widest)
    steep, bend = np.array([2 / widest]), np.array([0.0])  # bounds of |slope| and |second derivative|
    for i, (weight, bias) in enumerate(layers):
        value, slope = value @ weight + bias, slope @ weight
        steep, bend = steep @ np.abs(weight), bend @ np.abs(weight)
        if i < count - 1:
            value = np.tanh(value)
            slope = (1 - value * value) * slope
            bend = TANH_CURVATURE * steep * steep + bend
    error = value - np.cos(beyond)
    tilt = np.abs(slope - np.sin(beyond)) * half
    spread: FloatArray = tilt + (bend + 1.0) * half * half / 2 + ROUNDING
    return float((error - spread).min()), float((error + spread).max())


def _read(path_or_name: str | Path, origin: str) -> Certificate:
    try:
        _, text = read_bytes(path_or_name, SUFFIX)
    except ModelError:
        raise ModelError(f"'{origin}' has no certificate beside it; {REMEDY}") from None
    try:
        certificate = msgspec.json.decode(text, type=Certificate)
    except msgspec.MsgspecError as error:
        raise ModelError(f"the certificate of '{origin}' is unreadable: {error}; {REMEDY}") from None
    if certificate.schema != SCHEMA:
        raise ModelError(f"the certificate of '{origin}' has schema {certificate.schema}; {REMEDY}")
    return certificate
