"""Colours and type of the chart: one time scale for everything that moves, the rest in greys."""

from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LinearSegmentedColormap, Normalize

Rgba = tuple[float, float, float, float]

WATER = "#f3f7fa"
CHANNEL = "#dfe8f0"
CHANNEL_EDGE = "#a9bac9"
INK = "#1d2a35"
FAINT = "#5d6f7e"
GRID = "#d3dde5"
ROUTE = "#9fb0bd"
ALARM = "#c2410c"  # delta and a breach of it: orange stays apart from the time scale for every eye

SMALL_PT = 7.5
TEXT_PT = 8.5
TITLE_PT = 13.0

# viridis without its palest end, which drowns on a light ground; readable for colour-blind eyes and in grey
TIME_MAP = LinearSegmentedColormap.from_list("time", colormaps["viridis"](np.linspace(0.0, 0.82, 256)))


@dataclass(frozen=True, slots=True)
class TimeColour:
    """The colour of a time, seconds since the start of the run."""

    begin_s: float
    end_s: float

    @property
    def norm(self) -> Normalize:
        """The scale, for collections coloured by an array of seconds."""
        return Normalize(self.begin_s, max(self.end_s, self.begin_s + 1.0))

    def __call__(self, since_start_s: float) -> Rgba:
        """The colour at a time."""
        red, green, blue, alpha = TIME_MAP(float(self.norm(since_start_s)))
        return red, green, blue, alpha

    def ink(self, since_start_s: float) -> Rgba:
        """The same colour, dark enough for text."""
        red, green, blue, alpha = self(since_start_s)
        return 0.75 * red, 0.75 * green, 0.75 * blue, alpha
