"""The certificate of the packaged model: it holds, and nothing near it passes for it."""

import hashlib
import io
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rich.console import Console

from companion.errors import ModelError
from companion.planning import certificate
from companion.planning.certificate import Certificate
from companion.planning.model_file import read_bytes
from companion.planning.network import Network
from companion.planning.onnx_weights import float_constants
from models import certify, commands
from models.bounds import enclose, forward, teacher
from tests.builders import config

MODEL = read_bytes("straight")[1]
HELD = certificate.check("straight")


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    path = tmp_path / "copy.onnx"
    path.write_bytes(MODEL)
    write(path, HELD)
    return path


def write(path: Path, held: Certificate) -> None:
    path.with_suffix(certificate.SUFFIX).write_bytes(msgspec.json.encode(held))


def with_weight(name: str, index: int, change: float) -> bytes:
    """The model with one weight moved by `change`, in place in its bytes."""
    values = float_constants(MODEL)[name].astype("<f4")
    at = MODEL.index(values.tobytes()) + 4 * index
    moved = np.float32(values.ravel()[index] + change).tobytes()
    return MODEL[:at] + moved + MODEL[at + 4 :]


def test_the_packaged_model_is_certified_below_six_centimetres_everywhere() -> None:
    assert max(HELD.eps_m.values()) <= 0.06
    assert HELD.domain["course_noise_rad"] == (0.0, HELD.course_noise_max_rad)


def test_a_copy_with_its_certificate_passes(copy: Path) -> None:
    assert certificate.check(copy) == HELD


def test_one_changed_weight_is_refused_by_its_digest(copy: Path) -> None:
    copy.write_bytes(with_weight("weight1", 3, 1e-4))
    with pytest.raises(ModelError, match="another file"):
        certificate.check(copy)


@pytest.mark.parametrize("name", ["weight0", "weight1", "bias0", "bias1"])
def test_one_changed_weight_is_refused_at_start_by_the_certificate_beside_it(copy: Path, name: str) -> None:
    Network.load(copy, config())
    copy.write_bytes(with_weight(name, 0, 1e-4))
    with pytest.raises(ModelError, match=r"repulsion\.model = .*damaged or replaced"):
        Network.load(copy, config())


@pytest.mark.parametrize("name", ["weight0", "weight1", "bias0", "bias1"])
def test_one_changed_weight_is_refused_by_the_proof_even_under_a_fresh_seal(copy: Path, name: str) -> None:
    changed = with_weight(name, 5, -0.01)
    copy.write_bytes(changed)
    digest = hashlib.sha256(changed).hexdigest()
    write(copy, msgspec.structs.replace(HELD, model_sha256=digest).sealed())
    with pytest.raises(ModelError, match="does not hold"):
        certificate.check(copy)


def test_an_edited_certificate_is_refused(copy: Path) -> None:
    write(copy, msgspec.structs.replace(HELD, eps_per_metre_of_reach=1e-9))
    with pytest.raises(ModelError, match="changed after it was made"):
        certificate.check(copy)


def test_a_resealed_certificate_that_claims_too_much_is_refused(copy: Path) -> None:
    write(copy, msgspec.structs.replace(HELD, eps_per_metre_of_reach=1e-9).sealed())
    with pytest.raises(ModelError, match="does not hold"):
        certificate.check(copy)


def test_a_certificate_for_a_narrower_domain_than_the_models_is_refused(copy: Path) -> None:
    write(copy, msgspec.structs.replace(HELD, course_noise_max_rad=0.05).sealed())
    with pytest.raises(ModelError, match="another domain"):
        certificate.check(copy)


def test_a_model_without_certificate_is_refused(copy: Path) -> None:
    copy.with_suffix(certificate.SUFFIX).unlink()
    with pytest.raises(ModelError, match="no certificate"):
        certificate.check(copy)


def test_an_unreadable_certificate_is_refused(copy: Path) -> None:
    copy.with_suffix(certificate.SUFFIX).write_bytes(b"{")
    with pytest.raises(ModelError, match="unreadable"):
        certificate.check(copy)


def test_making_the_certificate_again_gives_the_same_one(copy: Path) -> None:
    assert certify.run(copy) == HELD


def test_the_command_shows_what_is_proven_and_fails_with_a_sentence(copy: Path) -> None:
    shown = Console(record=True, width=200, file=io.StringIO())
    assert commands.certify("straight", shown, check_only=True) == 0
    assert "the whole domain" in shown.export_text()
    copy.write_bytes(with_weight("weight1", 3, 1e-4))
    with pytest.raises(ModelError, match="another file"):
        commands.certify(str(copy), shown, check_only=True)


def test_both_proofs_enclose_what_dense_sampling_finds() -> None:
    layers, grid = certify.learned_layers(MODEL)
    widest = HELD.course_noise_max_rad
    noise = np.linspace(0.0, widest, 20_001)
    error = forward(layers, noise, widest) - teacher(noise, grid)
    maker = enclose(layers, grid, widest, 1e-7)
    low, high = certificate.enclose(MODEL, HELD)
    assert maker.low.min() <= error.min()
    assert error.max() <= maker.high.max()
    assert low <= error.min()
    assert error.max() <= high
    assert high - low < 2 * (error.max() - error.min())  # neither is loose


@pytest.mark.parametrize("size", [0, 1, 10, 1000, len(MODEL) - 7])
def test_truncated_bytes_give_no_weights_and_no_traceback(size: int) -> None:
    try:
        found = float_constants(MODEL[:size])
    except ValueError:
        return
    assert "weight0" not in found or len(found) < len(float_constants(MODEL))
