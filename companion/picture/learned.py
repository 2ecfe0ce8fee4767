"""Bounds learned from recorded traffic: how far a ship strays from its straight prediction.

    scale_i(x)  = exp(base_i,k + sum_f (weight_i,f + trend_k slope_i,f) (x_f - mean_f) / deviation_f)
    score       = ln( y_ahead / scale_ahead + y_astern / scale_astern + y_abeam / scale_abeam )   KITE
                  ln( the largest of the three )                                                  BOX
    set         = { y : score <= quantile_k(level) }         half sizes exp(quantile) * scale

with x the `FEATURES` of a ship at its report, y >= 0 how far it is ahead or astern and abeam (i) of the
prediction, k the age and trend_k = ln(age / 190 s) / 0.9.  The quantile is the split-conformal one, over
vessels no scale was fitted on.  A set never reaches beyond the way from the report at top speed: that bound
needs no data.

The file is TOML, written and documented by `companion calibrate`.
"""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from importlib import resources
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from companion.errors import ConfigError
from companion.messages import SPREAD_AGES_S, FloatArray, Model
from companion.picture.behaviour import FEATURES
from companion.picture.forecast import Outcome

VERSION = 2
SIDES = ("ahead", "astern", "abeam")
GROWTH = 1.3  # errors grow as age ** GROWTH between the stated ages
TREND = np.log(np.array(SPREAD_AGES_S) / 190.0) / 0.9
LEAST_M = 1.0
STILL_MPS = 0.1
REMEDY = "write one with `companion calibrate TRAFFIC...`, or leave contacts.bounds_file empty"


class BoundsFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The file's contents; see the module's docstring for the formulas."""

    version: int
    shape: Literal["kite", "box"]
    ages_s: tuple[float, ...]
    features: dict[str, tuple[float, float]]  # name -> mean, deviation
    weights: dict[str, tuple[float, float, float]]  # name -> of ahead, astern, abeam
    slopes: dict[str, tuple[float, float, float]]  # the same, of the age's trend
    base: dict[str, tuple[float, ...]]  # side -> one for each age
    quantiles: dict[str, tuple[float, ...]]  # level -> one for each age
    still_m: dict[str, tuple[float, ...]]  # level -> how far ships at rest were by then
    slow_m: dict[str, tuple[float, ...]]  # the same of those slower than under way, but not still
    trained_on: tuple[str, ...] = ()
    vessels: int = 0
    outcomes: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class LearnedBounds:
    """The file as arrays, for one level."""

    model: Model
    level: float
    mean: FloatArray  # (F,)
    deviation: FloatArray
    weights: FloatArray  # (K, 3, F)
    base: FloatArray  # (3, K)
    quantile: FloatArray  # (K,)
    still_m: FloatArray  # (K,) how far a ship at rest gets
    slow_m: FloatArray  # and one that creeps or swings at anchor

    def scores(self, outcomes: Sequence[Outcome]) -> FloatArray:
        """(n,) how far out outcomes are, in natural logarithms; above 0 (plus any raise) is outside."""
        features = np.array([o.forecast.features for o in outcomes]).reshape(-1, len(self.mean))
        off = np.array([(o.watch, o.age_s, o.ahead_m, o.aside_m) for o in outcomes]).reshape(-1, 4)
        k, age_s, ahead, aside = off[:, 0].astype(np.int64), off[:, 1], off[:, 2], off[:, 3]
        x = np.clip((features - self.mean) / self.deviation, -4.0, 4.0)
        grown = (age_s / np.array(SPREAD_AGES_S)[k]) ** GROWTH
        scale = np.exp(self.base[:, k] + np.einsum("nif,nf->in", self.weights[k], x)) * grown
        out = np.stack((np.maximum(ahead, 0.0), np.maximum(-ahead, 0.0), np.abs(aside))) / scale
        whole = out.sum(axis=0) if self.model is Model.KITE else out.max(axis=0)
        under_way = np.log(np.maximum(whole, 1e-6)) - self.quantile[k]
        sog = np.array([o.forecast.fix.sog_mps or 0.0 for o in outcomes])
        radius = np.where(sog < STILL_MPS, self.still_m[k], self.slow_m[k]) * grown
        at_rest = np.log(np.maximum(np.maximum(abs(ahead), abs(aside)) / radius, 1e-6))
        return np.asarray(np.where([o.forecast.fix.is_under_way for o in outcomes], under_way, at_rest))

    def log_scale(self, features: FloatArray) -> FloatArray:
        """(n, K, 3) natural logarithms of the scales at the stated ages, for `features` (n, F)."""
        x = np.clip((features - self.mean) / self.deviation, -4.0, 4.0)
        return np.asarray(self.base.T + np.einsum("kif,nf->nki", self.weights, x))

    def spread_m(
        self, log_scale: FloatArray, raised: FloatArray, sog_mps: FloatArray, top_mps: FloatArray
    ) -> FloatArray:
        """(n, K, 3) half sizes at the stated ages.

        `raised` (n, K) is added to the quantiles.
        """
        half = np.exp(log_scale + (self.quantile + raised)[:, :, None])
        for k in range(1, half.shape[1]):  # never less than at the age before
            np.maximum(half[:, k], half[:, k - 1], out=half[:, k])
        return limited(half, sog_mps, top_mps)

    def at_rest_m(self, raised: FloatArray, sog_mps: FloatArray, top_mps: FloatArray) -> FloatArray:
        """(n, K, 3) half sizes of the squares around ships not under way: at berth, at anchor, creeping.

        `raised` (n, K) is added to the logarithms.
        """
        radius = np.where((sog_mps < STILL_MPS)[:, None], self.still_m, self.slow_m) * np.exp(raised)
        return limited(np.repeat(radius[:, :, None], 3, axis=2), np.zeros(len(sog_mps)), top_mps)


def limited(half_m: FloatArray, sog_mps: FloatArray | float, top_mps: FloatArray | float) -> FloatArray:
    """(..., K, 3) half sizes within what a ship can do at all: `top_mps` times the age from its report."""
    ages = np.array(SPREAD_AGES_S)
    sog, top = np.asarray(sog_mps)[..., None], np.asarray(top_mps)[..., None]
    room = np.sqrt(np.maximum(top**2 - sog**2, 0.0))
    limits = np.stack(np.broadcast_arrays(top - sog, top + sog, room), axis=-1) * ages[:, None]
    return np.asarray(np.clip(half_m, LEAST_M, np.maximum(limits, LEAST_M)))


def load(path_or_name: str, level: float) -> LearnedBounds:
    """Read a bounds file, or a packaged one by its name; raises `ConfigError` with the remedy."""
    return prepare(parse(_read(path_or_name), path_or_name), level, path_or_name)


def digest(path_or_name: str) -> str:
    """SHA-256 of a bounds file; "" for none."""
    return sha256(_read(path_or_name).encode()).hexdigest() if path_or_name else ""


def parse(text: str, origin: str) -> BoundsFile:
    """The validated contents."""
    where = f"contacts.bounds_file = '{origin}'"
    try:
        file = msgspec.convert(tomllib.loads(text), BoundsFile)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{where}: not TOML: {error}; {REMEDY}") from None
    except msgspec.ValidationError as error:
        raise ConfigError(f"{where}: not a bounds file: {error}; {REMEDY}") from None
    if file.version != VERSION:
        raise ConfigError(f"{where}: version {file.version}, this companion reads {VERSION}; {REMEDY}")
    ages = len(SPREAD_AGES_S)
    rows = (*file.base.values(), *file.quantiles.values(), *file.still_m.values(), *file.slow_m.values())
    complete = (
        file.ages_s == SPREAD_AGES_S
        and tuple(file.features) == FEATURES
        and tuple(file.weights) == tuple(file.slopes) == FEATURES
        and tuple(file.base) == SIDES
        and all(len(row) == ages for row in rows)
        and all(deviation > 0 for _, deviation in file.features.values())
        and all(
            map(
                math.isfinite,
                (x for row in (*rows, *file.weights.values(), *file.slopes.values()) for x in row),
            )
        )
    )
    if not complete:
        raise ConfigError(f"{where}: its ages, features or sides are not this companion's; {REMEDY}")
    return file


def prepare(file: BoundsFile, level: float, origin: str) -> LearnedBounds:
    """The arrays for a level that the file states."""
    key = f"{level:g}"
    if not (key in file.quantiles and key in file.still_m and key in file.slow_m):
        known = ", ".join(file.quantiles)
        raise ConfigError(f"contacts.bounds_level = {key}: '{origin}' states {known}; choose one of them")
    features = np.array(list(file.features.values()))
    weights, slopes = (np.array([by[name] for name in FEATURES]).T for by in (file.weights, file.slopes))
    return LearnedBounds(
        model=Model.KITE if file.shape == "kite" else Model.BOX,
        level=level,
        mean=features[:, 0],
        deviation=features[:, 1],
        weights=np.ascontiguousarray(weights + TREND[:, None, None] * slopes),
        base=np.array([file.base[side] for side in SIDES]),
        quantile=np.array(file.quantiles[key]),
        still_m=np.array(file.still_m[key]),
        slow_m=np.array(file.slow_m[key]),
    )


def _read(path_or_name: str) -> str:
    packaged = resources.files("models") / f"{path_or_name}.bounds.toml"
    is_name = Path(path_or_name).name == path_or_name and not path_or_name.endswith(".toml")
    try:
        return packaged.read_text() if is_name else Path(path_or_name).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not text"
        raise ConfigError(f"contacts.bounds_file = '{path_or_name}': {reason}; {REMEDY}") from None
