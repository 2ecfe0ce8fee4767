"""Training is a command: reproducible, resumable, honest about its result."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from companion.errors import ConfigError
from companion.planning import certificate
from models import certify, spec
from models.bounds import forward

HERE = Path(__file__).parents[1] / "models"


def tiny(tmp_path: Path, model: str, /, **edits: str) -> Path:
    """A copy of a model's TOML file with some lines replaced."""
    lines = (HERE / f"{model}.toml").read_text().splitlines()
    for key, value in edits.items():
        lines = [f"{key} = {value}" if line.startswith(f"{key} =") else line for line in lines]
    path = tmp_path / f"{model}.toml"
    path.write_text("\n".join(lines))
    return path


@pytest.mark.train
def test_a_tiny_training_makes_model_certificate_and_card(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from models import card, evaluate, train  # noqa: PLC0415 - torch is not everywhere

    monkeypatch.setattr(evaluate, "POINTS", 2000)
    monkeypatch.setattr(card, "PER_BIN", 100)
    path = tiny(tmp_path, "straight", adam_steps="60", samples="64")
    seen: list[str] = []
    made = train.run(path, lambda stage, done, word: seen.append(stage))
    assert {"train", "evaluate", "certify", "card", "done"} <= set(seen)
    assert certificate.check(made).model == "straight"
    assert "Certificate" in made.with_suffix(".md").read_text()
    assert {p.suffix for p in tmp_path.iterdir()} == {".toml", ".onnx", ".json", ".md", ".png"}


@pytest.mark.train
def test_an_interrupted_training_ends_with_the_same_weights(tmp_path: Path) -> None:
    from models import checkpoint, shape  # noqa: PLC0415

    path = tiny(tmp_path, "straight", adam_steps="400", samples="32")
    settings = spec.load(path)
    assert isinstance(settings, spec.SupportSpec)

    class Stop(Exception):  # noqa: N818
        pass

    def stop_half_way(stage: str, done: float, word: str) -> None:
        if done > 0.6:
            raise Stop

    def silent(stage: str, done: float, word: str) -> None:
        pass

    with pytest.raises(Stop):
        shape.train(settings, checkpoint.Checkpoint(path), stop_half_way)
    resumed = shape.train(settings, checkpoint.Checkpoint(path), silent)
    unbroken = shape.train(settings, None, silent)
    for a, b in zip(resumed.weights, unbroken.weights, strict=True):
        assert (a == b).all()


@pytest.mark.train
def test_the_papers_network_trains_by_the_same_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from models import card, evaluate, train  # noqa: PLC0415

    monkeypatch.setattr(evaluate, "POINTS", 500)
    monkeypatch.setattr(card, "PER_BIN", 50)
    made = train.run(tiny(tmp_path, "paper15x16", steps="20", batch="64"))
    assert "nothing is proven" in made.with_suffix(".md").read_text()
    with pytest.raises(Exception, match="no certificate"):
        certificate.check(made)


@pytest.mark.train
def test_the_committed_model_comes_from_its_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from models import shape  # noqa: PLC0415

    path = tmp_path / "straight.toml"
    shutil.copy(HERE / "straight.toml", path)
    settings = spec.load(path)
    assert isinstance(settings, spec.SupportSpec)
    again = shape.train(settings, None, lambda stage, done, word: None)
    committed, _ = certify.learned_layers((HERE / "straight.onnx").read_bytes())
    widest = settings.course_noise_max_rad
    noise = np.linspace(0, widest, 101)
    # another machine may sum in another order
    assert np.abs(forward(again, noise, widest) - forward(committed, noise, widest)).max() < 5e-6


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("grid", "61", "grid"),
        ("adam_rate", "-1.0", "adam_rate"),
        ("seed", '"x"', "seed"),
        ("name", '"y"', "name"),
    ],
)
def test_settings_that_make_no_sense_are_refused_by_key(
    tmp_path: Path, key: str, value: str, says: str
) -> None:
    with pytest.raises(ConfigError, match=says):
        spec.load(tiny(tmp_path, "straight", **{key: value}))


def test_settings_that_are_not_there_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"give an existing models/NAME\.toml"):
        spec.load(tmp_path / "none.toml")


@pytest.mark.train
@pytest.mark.parametrize("seed", ["3", "4", "77"])
def test_the_turning_network_trains_and_certifies_on_other_seeds_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: str
) -> None:
    from models import card, evaluate, train  # noqa: PLC0415

    monkeypatch.setattr(evaluate, "TURNING_POINTS", 100)
    monkeypatch.setattr(card, "PER_BIN", 50)
    monkeypatch.setattr(card, "_picture_field", lambda *_: None)
    path = tiny(tmp_path, "turning", seed=seed)
    made = train.run(path)
    assert certificate.check(made).model == "turning"
    assert "slab" in made.with_suffix(".md").read_text()
