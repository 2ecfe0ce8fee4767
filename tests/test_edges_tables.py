"""Tables of AIS: the recorded one, the same in the other spellings, odd rows, any bytes."""

import csv
import gzip
import io
from collections import Counter
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from companion.edges import tables, traffic
from companion.errors import LogError
from companion.messages import ContactReport, Hull, TargetKind

HOUSTON = "ais_houston_ship_channel_20200101_1500-1700Z.csv.gz"
OLD = (
    "MMSI,BaseDateTime,LAT,LON,SOG,COG,Heading,VesselName,VesselType,"
    "Status,Length,Width,Draft,TransceiverClass"
)
NEW = (
    "mmsi,base_date_time,longitude,latitude,sog,cog,heading,vessel_name,vessel_type,"
    "status,length,width,draft,transceiver"
)
DANISH = (
    "# Timestamp,Type of mobile,MMSI,Latitude,Longitude,Navigational status,ROT,SOG,COG,Heading,IMO,Callsign,"
    "Name,Ship type,Cargo type,Width,Length,Type of position fixing device,Draught,Destination,ETA,"
    "Data source type,A,B,C,D"
)


def read(text: str, counts: Counter[str] | None = None) -> list[ContactReport]:
    assert tables.is_table(text.encode()[:4096])
    return list(tables.reports(Path("t.csv"), text, Counter() if counts is None else counts))


def old(row: dict[str, str]) -> list[str]:
    return [row[k] for k in ("MMSI", "BaseDateTime", "LAT", "LON", "SOG", "COG", "Heading", "VesselName")] + [
        row["VesselType"]
    ]


def new(row: dict[str, str]) -> list[str]:
    at = row["BaseDateTime"].replace("T", " ")
    rest = [row[k] for k in ("SOG", "COG", "Heading", "VesselName", "VesselType")]
    return [row["MMSI"], at, row["LON"], row["LAT"], *rest]


def danish(row: dict[str, str]) -> list[str]:
    at = datetime.fromisoformat(row["BaseDateTime"]).strftime("%d/%m/%Y %H:%M:%S")
    moving = ["", row["SOG"], row["COG"], row["Heading"]]
    place = [row["LAT"], row["LON"], "Unknown value"]
    return [at, "Class A", row["MMSI"], *place, *moving, "", "", row["VesselName"], row["VesselType"]]


@pytest.mark.parametrize(("head", "write"), [(OLD, old), (NEW, new), (DANISH, danish)])
def test_the_recorded_table_is_the_same_reports_in_every_spelling(
    head: str, write: Callable[[dict[str, str]], list[str]], shared_data: Path
) -> None:
    path = shared_data / HOUSTON
    text = gzip.decompress(path.read_bytes()).decode()
    spelt = io.StringIO()
    spelt.write(head + "\n")
    csv.writer(spelt).writerows(write(row) for row in csv.DictReader(io.StringIO(text)))
    counts: Counter[str] = Counter()
    found = [replace(r, kind=TargetKind.UNKNOWN) for r in read(spelt.getvalue(), counts)]
    assert found == list(traffic.read(path, Counter()))
    assert len(found) == 14_060
    assert not counts


def test_what_the_table_tells_of_the_ship_is_taken() -> None:
    row = "366996430,2026-03-31 00:00:00,-82.55641,38.40362,0.1,295.2,100,CAPT JEFF IRBY,31,12,20,8,3.3,B"
    (report,) = read(f"{NEW}\n{row}\n")
    assert (report.latitude_deg, report.longitude_deg) == (38.40362, -82.55641)
    assert report.hull == Hull(20.0, 20.0, 8.0, 8.0)
    assert (report.draught_m, report.ship_type, report.navigational_status) == (3.3, 31, 12)
    assert (report.kind, report.name) == (TargetKind.CLASS_B, "CAPT JEFF IRBY")


def test_the_danish_words_are_codes_and_its_sides_are_both_the_larger() -> None:
    rows = (
        "18/03/2023 00:00:07,Class A,352002266,55.4921,14.7525,At anchor,0.7,12.5,241.8,241,Unknown,,ANNA,"
        "Tanker,,20,150,GPS,7.5,,,AIS,120,30,5,15\n"
        "18/03/2023 00:00:00,Base Station,2190064,56.7166,11.519,Unknown value,,,,,Unknown,,,Undefined,,,,"
        "GPS,,,,AIS,,,,\n"
        "18/03/2023 00:00:01,SAR Airborne,111219501,56.7,11.5,Unknown value,,90.0,10.0,,,,,,,,,,,,,AIS,,,,\n"
    )
    base, aircraft, ship = read(f"{DANISH}\n{rows}")
    assert ship.hull == Hull(120.0, 30.0, 15.0, 15.0)
    assert (ship.navigational_status, ship.ship_type, ship.draught_m) == (1, 80, 7.5)
    assert (ship.kind, base.kind, aircraft.kind) == (
        TargetKind.CLASS_A,
        TargetKind.UNKNOWN,
        TargetKind.AIRCRAFT,
    )
    assert (base.sog_mps, base.cog_rad, base.heading_rad, base.hull) == (None, None, None, None)


@pytest.mark.parametrize(
    "row",
    [
        "x,2020-01-01T00:00:00,29,-95,1,1",
        "366996430,yesterday,29,-95,1,1",
        "366996430,9999-01-01T00:00:00,29,-95,1,1",
        "366996430,2020-01-01T00:00:00,91,181,1,1",
        "366996430,2020-01-01T00:00:00,29",
    ],
)
def test_a_row_that_makes_no_sense_is_counted(row: str) -> None:
    counts: Counter[str] = Counter()
    assert read(f"MMSI,BaseDateTime,LAT,LON,SOG,COG\n{row}\n", counts) == []
    assert counts["table.bad_row"] == 1


def test_a_table_without_its_columns_is_refused_with_their_names() -> None:
    with pytest.raises(LogError, match=r"lacks the columns basedatetime, cog"):
        tables.reports(Path("t.csv"), "MMSI,LAT,LON,SOG\n", Counter())


@given(st.text(alphabet='0123456789.-+:/T,"\n\0 naif', max_size=300), st.sampled_from([OLD, NEW, DANISH]))
def test_no_text_raises_and_every_number_is_in_its_range(text: str, head: str) -> None:
    for report in read(f"{head}\n{text}"):
        assert report.latitude_deg is not None
        assert -90 <= report.latitude_deg <= 90
        assert report.sog_mps is None or 0 <= report.sog_mps < 53
        assert report.hull is None or report.hull.bow_m <= 1022
        assert abs(report.measured_at) < 2**63
