"""From a calibration to the bounds file: TOML that explains itself."""

import numpy as np

from companion.calibrate.conformal import KS, Calibration, quantile
from companion.calibrate.dataset import Dataset
from companion.messages import SPREAD_AGES_S, FloatArray
from companion.picture.behaviour import FEATURES
from companion.picture.learned import SIDES, STILL_MPS, VERSION

WIDEST = 20.0  # of a quantile: stands for "as far as the ship can go at all"


def text(found: Calibration, data: Dataset, levels: tuple[float, ...], sources: list[str]) -> str:
    """The file's text."""
    scales = found.scales
    lines = [
        "# Bounds learned by `companion calibrate`: how far ships stray from their straight prediction.",
        '# Use: [contacts] bounds_file = "this file", bounds_level = one of the levels below.',
        "#",
        "#   x         = (feature - mean) / deviation, within +-4",
        "#   trend     = ln(age / 190 s) / 0.9",
        "#   scale     = exp(base + sum of (weight + trend * slope) * x)",
        "#               for ahead, astern and abeam, at each age",
        "#   half size = scale * exp(quantile)                      metres; never beyond top speed * age",
        "#",
        "# kite: corners ahead, astern and abeam of the predicted point; box: the rectangle of these sizes.",
        "# The meaning of every feature is in companion/picture/behaviour.py.",
        "",
        f"version = {VERSION}",
        f'shape = "{scales.shape}"',
        f"ages_s = {_row(SPREAD_AGES_S)}",
        f"trained_on = [{', '.join(chr(34) + s + chr(34) for s in sources)}]",
        f"vessels = {len(np.unique(data.vessel[data.under_way]))}",
        f"outcomes = [{', '.join(str(len(data.at(k))) for k in KS)}] # that set the quantiles, for each age",
        "",
        "[features] # name = [mean, deviation]",
        *(f"{n} = {_row((m, d))}" for n, m, d in zip(FEATURES, scales.mean, scales.deviation, strict=True)),
        "",
        f"[weights] # name = [{', '.join(SIDES)}]",
        *(f"{name} = {_row(scales.weights[:, i])}" for i, name in enumerate(FEATURES)),
        "",
        "[slopes] # the same",
        *(f"{name} = {_row(scales.slopes[:, i])}" for i, name in enumerate(FEATURES)),
        "",
        "[base] # natural logarithm of metres, for each age",
        *(f"{side} = {_row(scales.base[i])}" for i, side in enumerate(SIDES)),
        "",
        "[quantiles] # level = natural logarithm, for each age; of vessels no scale was fitted on",
        *(f'"{v:g}" = {_row(_quantiles(found, v))}' for v in levels),
        "",
        "[still_m] # level = metres by each age that ships at rest were off; cut at top speed * age",
        *(f'"{v:g}" = {_row(_rest_m(data, v, is_still=True))}' for v in levels),
        "",
        "[slow_m] # the same of ships neither still nor under way",
        *(f'"{v:g}" = {_row(_rest_m(data, v, is_still=False))}' for v in levels),
    ]
    return "\n".join(lines) + "\n"


def _quantiles(found: Calibration, level: float) -> list[float]:
    return [min(found.quantile(k, level), WIDEST) for k in KS]


def _rest_m(data: Dataset, level: float, *, is_still: bool) -> list[float]:
    found = []
    rest = data.only(~data.under_way & ((data.sog_mps < STILL_MPS) == is_still))
    for k in KS:
        part = rest.only(rest.watch == k)
        off = np.hypot(part.ahead_m, part.aside_m)
        found.append(min(quantile(off, level), 16.0 * SPREAD_AGES_S[k]))
    return [float(x) for x in np.maximum.accumulate(found)]


def _row(values: FloatArray | tuple[float, ...] | list[float]) -> str:
    return f"[{', '.join(repr(round(float(v), 6)) for v in values)}]"
