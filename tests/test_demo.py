"""The commands as a person runs them: exit status, run folder, pictures, sentences."""

import json
from pathlib import Path

import pytest

from companion.cli import main
from companion.record import LOG_NAME, Log

OWN_ECHO = 244010225  # the recording boat's own class B, on its own bus


@pytest.fixture(scope="module")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, Path]:
    """One demo of the paper's case; the folder it left."""
    parent = tmp_path_factory.mktemp("runs")
    status = main(["demo", "--out", str(parent)])
    (folder,) = parent.iterdir()
    return status, folder


def test_the_papers_crossing_arrives_and_never_comes_within_delta(crossing: tuple[int, Path]) -> None:
    status, folder = crossing
    assert status == 0
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["arrived"]
    assert summary["failures"] == []
    # force balance of eq. (10): delta + (K_r / K_p)^(1/3)
    assert summary["closest_set"]["distance_m"] == pytest.approx(19.42, abs=0.5)
    assert summary["closest_hull"]["distance_m"] > summary["closest_set"]["distance_m"]
    assert summary["contacts_heard"] == 10
    assert 300 < summary["oldest_used_s"] < 600
    assert (folder / "crossing.png").read_bytes().startswith(b"\x89PNG")


def test_its_log_replays_to_the_last_bit(
    crossing: tuple[int, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    _, folder = crossing
    assert main(["replay", str(folder)]) == 0
    assert "every decision and every byte sent the same" in capsys.readouterr().out


def test_its_log_cut_in_half_replays_as_far_as_it_goes(
    crossing: tuple[int, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, folder = crossing
    whole = (folder / LOG_NAME).read_bytes()
    (tmp_path / LOG_NAME).write_bytes(whole[: len(whole) // 8])
    assert main(["replay", str(tmp_path)]) == 0
    assert "breaks off" in capsys.readouterr().out


def test_frames_of_every_promised_kind_are_in_the_log(crossing: tuple[int, Path]) -> None:
    from pymavlink.dialects.v20 import common as mav  # noqa: PLC0415

    _, folder = crossing
    parser, seen = mav.MAVLink(None), set()
    parser.robust_parsing = True
    sent = mav.MAVLink(None)
    for step in Log(folder).steps():
        for frame in step.tick.frames:
            if frame.can_id:
                seen.add(f"PGN {(frame.can_id >> 8) & 0x3FFFF}")
            else:
                seen |= {m.get_type() for m in parser.parse_buffer(frame.data) or []}
        for data in step.sent:
            seen |= {m.get_type() for m in sent.parse_buffer(data) or []}
        if step.number > 1200:
            break
    assert seen >= {
        "HEARTBEAT",
        "SYSTEM_TIME",
        "GLOBAL_POSITION_INT",
        "LOCAL_POSITION_NED",
        "ATTITUDE",
        "AIS_VESSEL",
        "COMMAND_ACK",
        "COMMAND_LONG",
        "SET_POSITION_TARGET_LOCAL_NED",
        "PGN 129038",
        "PGN 129794",
    }


@pytest.mark.parametrize("scenario", ["px4_crossing", "boat_crossing"])
def test_other_autopilots_and_hulls_cross_too(scenario: str, tmp_path: Path) -> None:
    assert main(["demo", "--scenario", scenario, "--out", str(tmp_path)]) == 0


def test_a_recorded_lake_is_crossed(shared_data: Path, tmp_path: Path) -> None:
    log = shared_data / "n2k_ijsselmeer_20221130_native.candump.gz"
    assert main(["demo", "--traffic", str(log), "--out", str(tmp_path)]) == 0
    (folder,) = tmp_path.iterdir()
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["contacts_heard"] > 90
    dived = [step for step in Log(folder).steps() if step.tracks][-1]
    assert dived.tracks is not None
    assert OWN_ECHO not in json.loads(dived.tracks)["mmsi"]


def test_a_recorded_shipping_lane_is_crossed_with_one_surfacing_for_news(
    shared_data: Path, tmp_path: Path
) -> None:
    log = shared_data / "n2k_gulf_of_finland_20140815_refragmented.candump.gz"
    assert main(["demo", "--traffic", str(log), "--out", str(tmp_path)]) == 0
    (folder,) = tmp_path.iterdir()
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["closest_hull"]["distance_m"] > 100
    assert summary["truth_until_s"] == pytest.approx(600, abs=1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["demo", "--traffic", "none.log"], "none.log"),
        (["demo", "--scenario", "none"], "uuv_crossing"),
        (["demo", "--goal", "59.9,80.0"], "goal"),
        (["run"], "--goal"),
        (["run", "--goal", "1,2", "--mavlink", "carrier-pigeon:1"], "carrier-pigeon"),
        (["run", "--goal", "1,2", "--can", "no_such_interface:0"], "no_such_interface"),
        (["run", "--config", "none.toml"], "none.toml"),
        (["replay", "."], "log"),
    ],
)
def test_a_mistake_is_answered_with_a_sentence_and_status_2(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = [] if arguments[0] == "replay" else ["--out", str(tmp_path / "runs")]
    assert main([*arguments, *out]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said


def test_a_board_that_requires_a_certificate_refuses_a_model_without_one(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    config = tmp_path / "c.toml"
    config.write_text('goal = { latitude_deg = 1.0, longitude_deg = 2.0 }\nrepulsion.model = "paper15x16"\n')
    assert main(["run", "--config", str(config), "--require-certificate", "--out", str(tmp_path)]) == 2
    assert "certificate" in capsys.readouterr().err


@pytest.mark.parametrize("content", [b"", b"not onnx at all", b"\x08\x07" * 500])
def test_a_foreign_model_is_refused_at_start(
    content: bytes, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    model, config = tmp_path / "foreign.onnx", tmp_path / "c.toml"
    model.write_bytes(content)
    config.write_text(f'repulsion.model = "{model}"\n')
    assert main(["demo", "--config", str(config), "--out", str(tmp_path / "runs")]) == 2
    assert "repulsion.model" in capsys.readouterr().err


def test_a_model_for_other_constants_is_refused_at_start(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    config = tmp_path / "c.toml"
    config.write_text("field.delta_m = 6.0\n")
    assert main(["demo", "--config", str(config), "--out", str(tmp_path / "runs")]) == 2
    assert "delta" in capsys.readouterr().err
