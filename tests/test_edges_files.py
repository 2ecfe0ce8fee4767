import gzip
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.edges.files import CandumpFrame, read_candump
from companion.errors import LogError

LINES = (
    b"(1669809630.000176) can0 19F01414#5020202020202020\n"
    b"(1669809630.000681) vcan1 19FA0400#C5FF\n"
    b"(1669809631.5) can0 09F80114#\n"
)
FRAMES = [
    CandumpFrame(1_669_809_630_000_176_000, 0x19F01414, bytes.fromhex("5020202020202020")),
    CandumpFrame(1_669_809_630_000_681_000, 0x19FA0400, bytes.fromhex("C5FF")),
    CandumpFrame(1_669_809_631_500_000_000, 0x09F80114, b""),
]


def test_a_plain_and_a_packed_log_read_the_same(tmp_path: Path) -> None:
    plain, packed = tmp_path / "a.log", tmp_path / "b.log"
    plain.write_bytes(LINES)
    packed.write_bytes(gzip.compress(LINES))
    assert list(read_candump(plain)) == list(read_candump(packed)) == FRAMES


def test_windows_line_ends_and_direction_marks_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(LINES.replace(b"\n", b" R\r\n"))
    assert list(read_candump(path)) == FRAMES


@pytest.mark.parametrize(
    "line",
    [
        b"nonsense",
        b"(1.5) can0 123#00",  # an 11-bit identifier
        b"(1.5) can0 20000000#0000000000000000",  # an error frame
        b"(1.5) can0 09F80114#R",  # a remote frame
        b"(1.5) can0 09F80114##100",  # CAN FD
        b"(1.5) can0 09F80114#00112233445566778899",
        b"(1.5) can0 09F80114#0",
        b"(-1.5) can0 09F80114#00",
        b"(nan) can0 09F80114#00",
    ],
)
def test_a_line_that_is_no_data_frame_is_left_out_and_counted(tmp_path: Path, line: bytes) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(line + b"\n" + LINES)
    counts: Counter[str] = Counter()
    assert list(read_candump(path, counts)) == FRAMES
    assert counts == {"candump.bad_line": 1}


@pytest.mark.parametrize("kept", [0.3, 0.6, 0.9])
def test_a_packed_log_that_breaks_off_gives_what_it_has(tmp_path: Path, kept: float) -> None:
    lines = b"".join(b"(%d.25) can0 09F80114#%016X\n" % (k, k * 7919**3) for k in range(3000))
    packed = gzip.compress(lines)
    path = tmp_path / "a.gz"
    path.write_bytes(packed[: int(len(packed) * kept)])
    counts: Counter[str] = Counter()
    frames = list(read_candump(path, counts))
    assert 0.5 * kept * 3000 < len(frames) < 3000
    assert [frame.unix_ns // 1_000_000_000 for frame in frames] == list(range(len(frames)))
    assert counts["candump.broken_off"] == 1


def test_a_missing_file_says_what_to_do_before_it_is_read(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"nowhere\.log.*candump log"):
        read_candump(tmp_path / "nowhere.log")


def test_a_folder_and_a_picture_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="candump log"):
        read_candump(tmp_path)
    picture = tmp_path / "a.png"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    with pytest.raises(LogError, match="not text"):
        read_candump(picture)
    broken = tmp_path / "b.gz"
    broken.write_bytes(b"\x1f\x8bnot gzip at all")
    with pytest.raises(LogError, match="candump log"):
        read_candump(broken)


@given(st.lists(st.binary(max_size=60), max_size=20))
def test_no_content_makes_it_raise(tmp_path_factory: pytest.TempPathFactory, lines: list[bytes]) -> None:
    path = tmp_path_factory.getbasetemp() / "random.log"
    path.write_bytes(LINES * 100 + b"\n".join(lines) + b"\n" + LINES)
    frames = list(read_candump(path))
    assert frames[:300] == FRAMES * 100
    assert frames[-3:] == FRAMES


def test_the_recorded_logs_have_no_bad_line(shared_data: Path) -> None:
    counts: Counter[str] = Counter()
    path = shared_data / "n2k_gulf_of_finland_20140815_refragmented.candump.gz"
    assert sum(1 for _ in read_candump(path, counts)) == 52_443
    assert not counts
