"""What the sub-commands' options are made of."""

import argparse
from typing import TypeAlias

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def position(text: str) -> tuple[float, float]:
    """LAT,LON in degrees."""
    try:
        latitude, longitude = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not LAT,LON in degrees, such as 59.72,24.74") from None
    if not (abs(latitude) <= 90 and abs(longitude) <= 180):
        raise argparse.ArgumentTypeError(f"{text!r}: latitude is within 90 and longitude within 180 degrees")
    return latitude, longitude


def speedup(text: str) -> float:
    """A factor on real time."""
    try:
        factor = float(text)
    except ValueError:
        factor = 0.0
    if not 0.01 <= factor <= 1000:
        raise argparse.ArgumentTypeError(f"{text!r} is not a factor between 0.01 and 1000")
    return factor
