"""The model card: NAME.md beside the ONNX file, with two pictures measured from the file itself."""

from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from companion.errors import ModelError
from companion.messages import FloatArray
from companion.planning import certificate
from companion.planning.model_file import METADATA_KEY, TURNING, Metadata, decode_metadata, read_bytes
from companion.planning.network import infer, open_session
from companion.planning.onnx_weights import metadata_text
from companion.planning.rows import COLUMNS
from models import sampling
from models.evaluate import degrees_between
from models.spec import Spec

WHAT_IS_LEARNED = """
## What is learned, and what is not

The distance to a convex set is the greatest, over unit directions n, of n . p - h(n), h the set's
support function. The network learns h for fixed directions in the ship's course frame. Scale needs
no learning: a ship's velocities fill one shape, set by the course noise alone, that grows with the
reach; so the learned part maps the course noise to one support value per direction, and the graph
multiplies it by the reach. Hull, heading error and position error enter the sum in closed form; the
flanks, the front arc, the hull's edges and corners get directions of their own, computed in the graph.

Said plainly: for this ship the exact set has a closed form too and costs less than the network. The
network is the paper's method made safe, and the pattern for models whose sets are not cheap.
"""
WHAT_TURNS = """
## What is learned, and what is not

The set of a ship that turns is a union over time. It is cut into slabs of ten seconds, as
`companion/reach/turning.py` cuts it, each convex, and the distance is the least over the slabs of the
greatest over directions n of n . p - h(n), h the slab's support function. Ahead and astern h is made of
sweeps of angles, and of every sweep the network gives the mean of the cosine: how much of what a turning
ship sails is made good in a direction. That one function of two angles is learned, by twelve neurons, and
used four times for each of 50 directions of each slab. What is added and clipped around it, the hull and
the position error have closed forms, computed in the graph.

Said plainly: the mean of a cosine has a closed form too; learned it costs no more. What makes this file
twenty times faster than the exact slabs is that all slabs of all ships are one call without branches.
"""
WHAT = {"support": WHAT_IS_LEARNED, TURNING: WHAT_TURNS}
BINS = np.geomspace(0.1, 400.0, 13)  # of delta
PER_BIN = 3000
TURNING_SHARE = 0.2  # of as many points, for sets that are expensive


def write(model: Path, settings: Spec) -> Path:
    """Measure and write the card; returns its path."""
    content = model.read_bytes()
    metadata = decode_metadata(metadata_text(content, METADATA_KEY), str(model))
    with mpl.rc_context({"svg.hashsalt": settings.name, "font.size": 9}):
        _picture_errors(model, settings)
        _picture_field(model, metadata)
    card = model.with_suffix(".md")
    card.write_text(_text(model, metadata, settings), encoding="utf-8")
    return card


def _answers(model: Path, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return infer(open_session(model.read_bytes(), str(model)), rows)


def _picture_errors(model: Path, settings: Spec) -> None:
    """Error of distance and direction against the true distance."""
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    rng = np.random.default_rng((settings.seed, 2))
    middle, under, over, turned = [], [], [], []
    for low, high in pairwise(BINS * settings.field.delta_m):
        share = 1.0 if len(settings.domain) == len(COLUMNS) else TURNING_SHARE
        rows = sampling.around(rng, int(share * PER_BIN), settings.domain, low, high)
        distance, away, _ = _answers(model, rows)
        true_distance, true_away = sampling.exact(rows)
        middle.append(np.sqrt(low * high))
        error = true_distance - distance
        under.append(np.percentile(error, [50, 99]))
        over.append(max(-float(error.min()), 0.0))
        turned.append(np.percentile(degrees_between(away, true_away), [50, 99]))
    for axes, values, label in (
        (left, np.array(under), "true minus learned distance, m"),
        (right, np.array(turned), "direction error, degrees"),
    ):
        axes.plot(middle, np.maximum(values[:, 0], 1e-4), marker="o", ms=3, label="median")
        axes.plot(middle, np.maximum(values[:, 1], 1e-4), marker="s", ms=3, label="99 of 100")
        axes.set(xscale="log", yscale="log", xlabel="distance from the set, m", ylabel=label)
        axes.grid(alpha=0.3)
    if max(over) > 0:
        left.plot(middle, np.maximum(over, 1e-4), color="tab:red", marker="x", label="worst unsafe")
    left.legend()
    figure.savefig(model.with_name(f"{model.stem}_error.png"), dpi=110, metadata={"Software": None})


def _picture_field(model: Path, metadata: Metadata) -> None:
    """Repulsion around one set, exact beside learned, on a logarithmic scale."""
    row = _typical(metadata)
    reach = max(row[4], row[5]) * (row[3] + row[6])
    margin = 0.18 * reach + 3 * (row[10] + row[12]) + 2 * metadata.delta_m
    rows, _, _ = _over(row, -margin, reach + margin, 34, 0.6 * margin, 21)
    x, y = rows[:, 0], rows[:, 1]
    true_distance, true_away = sampling.exact(rows)
    gap = np.maximum(true_distance - metadata.delta_m, metadata.singular_gap_m)
    exact = metadata.k_r / gap[:, None] ** 3 * true_away
    _, _, learned = _answers(model, rows)
    fine, along, across = _over(row, -margin, reach + margin, 200, 0.6 * margin, 100)
    outline = sampling.exact(fine)[0].reshape(len(across), len(along))
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    for axes, force, title in zip(figure.subplots(1, 2, sharey=True), (exact, learned), ("exact", "learned"),
                                  strict=True):  # fmt: skip
        strength = np.hypot(force[:, 0], force[:, 1])
        outside = true_distance > 0
        unit = force / strength[:, None]
        drawn = axes.quiver(
            x[outside], y[outside], unit[outside, 0], unit[outside, 1], np.log10(strength[outside]),
            cmap="viridis", angles="xy", scale=38, width=0.003,
        )  # fmt: skip
        axes.contour(
            along, across, outline, levels=[0.0, metadata.delta_m], colors=["tab:red", "tab:orange"],
            linewidths=1.0,
        )  # fmt: skip
        axes.set(title=title, xlabel="along the course, m", aspect="auto")
    figure.axes[0].set_ylabel("to starboard, m")
    figure.colorbar(drawn, ax=figure.axes, label="log10 of the force, m/s")
    figure.savefig(model.with_name(f"{model.stem}_field.png"), dpi=90, metadata={"Software": None})


def _over(
    row: FloatArray, first: float, last: float, columns: int, half: float, lines: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows of one ship on a northerly course with the vehicle on a grid; the grid's two axes."""
    along, across = np.linspace(first, last, columns), np.linspace(-half, half, lines)
    rows = np.repeat(row[None], columns * lines, axis=0)
    x, y = np.meshgrid(along, across)
    rows[:, 0], rows[:, 1] = x.ravel(), y.ravel()
    return rows, along, across


def _typical(metadata: Metadata) -> FloatArray:
    """The paper's ship half-way through its silence, as near as the ranges allow."""
    horizon = min(metadata.horizon_s, 600.0 if metadata.kind != TURNING else 360.0)
    wanted = {
        "speed_mps": 5.0, "age_s": 0.5 * horizon, "until_age_s": horizon,
        "speed_noise_mps": 0.05, "course_noise_rad": 0.01, "heading_error_rad": 0.01,
        "bow_m": 37.5, "stern_m": 37.5, "port_m": 12.5, "starboard_m": 12.5,
        "turn_rate_radps": 0.004, "turn_rate_error_radps": 0.0005,
    }  # fmt: skip
    row = [min(max(wanted.get(i.name, 0.0), i.low), i.high) for i in metadata.inputs]
    return np.array(row)


def _text(model: Path, metadata: Metadata, settings: Spec) -> str:
    name = metadata.name
    software = ", ".join(f"{part} {version}" for part, version in metadata.software.items())
    return f"""# {name}

{settings.about}

Made by `companion train models/{name}.toml`: seed {metadata.training_seed}, {software}.
{WHAT.get(metadata.kind, "")}
## Against the exact field

Through onnxruntime, over the whole domain of the inputs below, {metadata.delta_m:g} to
{2 * metadata.delta_m:g} m from the set (delta to twice delta).

{_errors(metadata.error)}

![errors]({name}_error.png)

![field]({name}_field.png)

{_beside_plain(model, metadata)}## Certificate

{_certificate(model)}

## Inputs

`contacts` (n, {len(metadata.inputs)}) float64, one row per contact:

| column | unit | from | to | frame |
| --- | --- | --- | --- | --- |
{chr(10).join(f"| {i.name} | {i.unit} | {i.low:g} | {i.high:g} | {i.frame} |" for i in metadata.inputs)}

Fixed inside: delta = {metadata.delta_m:g} m, K_r = {metadata.k_r:g}, T up to {metadata.horizon_s:g} s.
Sign: {metadata.output_sign}.

## Beside the other ways

[Latency and errors](latency.md) of every network and of the exact sets, for 1 to 10000 ships.
"""


def _errors(error: dict[str, float]) -> str:
    lines = ["| | p50 | p95 | p99 | greatest |", "| --- | --- | --- | --- | --- |"]
    for key, label, factor in (
        ("distance_under_m", "true minus learned distance, m", 1.0),
        ("direction_deg", "direction, degrees", 1.0),
        ("magnitude_relative", "magnitude, percent", 100.0),
    ):
        values = " | ".join(f"{factor * error[f'{key}_{p}']:.3g}" for p in ("p50", "p95", "p99", "max"))
        lines.append(f"| {label} | {values} |")
    unsafe = (
        f"{error['unsafe_points']:.0f} of {error['points']:.0f}, the worst by {error['unsafe_max_m']:.3g} m"
    )
    return "\n".join([*lines, "", f"Unsafe points (more distance claimed than there is): {unsafe}."])


def _beside_plain(model: Path, metadata: Metadata) -> str:
    """The turning network and the plain baseline on the baseline's ships, 5 to 10 m off."""
    try:
        _, content = read_bytes(f"{model.stem}4x64")
    except ModelError:
        return ""
    plain = decode_metadata(metadata_text(content, METADATA_KEY), "")
    domain = {i.name: (i.low, i.high) for i in plain.inputs}
    rng = np.random.default_rng(3)
    rows = sampling.around(rng, 3000, domain, metadata.delta_m, 2 * metadata.delta_m)
    true_distance, true_away = sampling.exact(rows)
    lines = [
        "| | distance p50 / p99, m | direction p50 / p99, degrees | unsafe |",
        "| --- | --- | --- | --- |",
    ]
    for name, (distance, away, _) in (
        (metadata.name, _answers(model, rows)),
        (plain.name, infer(open_session(content, plain.name), rows)),
    ):
        off = np.percentile(np.abs(true_distance - distance), [50, 99])
        turned = np.percentile(degrees_between(away, true_away), [50, 99])
        unsafe = int((distance > true_distance).sum())
        lines.append(
            f"| {name} | {off[0]:.3g} / {off[1]:.3g} | {turned[0]:.3g} / {turned[1]:.3g} "
            f"| {unsafe} of {len(rows)} |"
        )
    return "\n".join(["On the ships of the plain network, the only ones it knows:", "", *lines, "", ""])


def _certificate(model: Path) -> str:
    try:
        held = certificate.check(model)
    except ModelError:
        return "None: nothing is proven about this network."
    rows = "\n".join(f"| {where} | {eps:.4f} |" for where, eps in held.eps_m.items())
    return f"""{held.property}.

| domain | eps, m |
| --- | --- |
{rows}

Conditions: {"; ".join(held.conditions)}. Method: {held.method} ({held.cells} cells); proven again by
another method, without torch, by `companion certify --check {held.model}`. Rounding: {held.rounding}."""
