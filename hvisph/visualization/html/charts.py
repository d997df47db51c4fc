"""Embedded pictures, charts of the history, and the main moments of a run."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hvisph.core.measure_catalogue import axis_unit, format_of
from hvisph.core.text import PlainMapping
from hvisph.measures.measure import Measures
from hvisph.output.snapshot import Snapshot

if TYPE_CHECKING:
    from matplotlib.figure import Figure


Charts = list[dict[str, str]]  # SVG and caption of each
MOST_POINTS = 400  # of a line
COLOURS = 256  # of a colour map


def chart(
    time: np.ndarray,
    lines: Mapping[str, np.ndarray],
    unit: str,
    caption: str,
    unitless: bool,
    bands: Mapping[str, np.ndarray] | None = None,
) -> dict[str, str]:
    """Return a chart of lines over time: its SVG and its caption.

    `lines`: values by label, each (n,), in `unit`.
    `bands`: what lines are uncertain by, each (n,), by their labels: drawn as bands, and the values as marks.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context({"font.size": 9}):
        figure = Figure(figsize=(4.2, 2.5), layout="constrained")
        axes = figure.add_subplot()
        thin = np.unique(np.linspace(0, len(time) - 1, min(len(time), MOST_POINTS)).astype(int))
        word, factor = ("", 1.0) if unitless else axis_unit("us", time[-1:])
        for label, values in lines.items():
            spread = (bands or {}).get(label)
            mark = "" if spread is None else "."
            (line,) = axes.plot(time[thin] * factor, values[thin], label=label, linewidth=1.3, marker=mark)
            if spread is not None:
                low, high = (values + sign * np.nan_to_num(spread) for sign in (-1.0, 1.0))
                axes.fill_between(time[thin] * factor, low[thin], high[thin], color=line.get_color(), alpha=0.2, lw=0)
        axes.set(xlabel="time" if unitless else f"time [{word.replace('us', 'µs')}]", ylabel=unit)
        axes.margins(x=0.0)
        axes.grid(alpha=0.3)
        if len(lines) > 1 or bands:
            axes.legend(fontsize=7, frameon=False)
    return {"svg": embed_figure(figure, caption), "caption": caption}


def embed_figure(figure: Figure, caption: str) -> str:
    """Return a figure as an element of a page: SVG without prologue and metadata, with a name for readers."""
    from matplotlib import rc_context

    text = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "hvisph"}):
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    svg = text.getvalue()
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    label = caption.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    return re.sub(r"<svg ", f'<svg role="img" aria-label="{label}" ', body, count=1)


def embedded_image(figure: Figure, dpi: int) -> str:
    """Return a figure of many particles as the address of an image that holds itself."""
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=dpi, pil_kwargs={"optimize": True})
    return f"data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}"


def embedded_pixels(image: np.ndarray) -> str:
    """Return an image, RGB from 0 to 1, the top row first, as the address of one that holds itself."""
    from PIL import Image

    data = io.BytesIO()
    palette = Image.fromarray((image * 255.0).round().astype(np.uint8)).quantize(64)
    palette.save(data, format="PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}"


def colour_tables(names: Sequence[str]) -> dict[str, str]:
    """Return the colour maps as base64 of 256 RGB triples."""
    from matplotlib import colormaps

    steps = np.linspace(0.0, 1.0, COLOURS)
    return {
        name: base64.b64encode((colormaps[name](steps)[:, :3] * 255.0).round().astype(np.uint8).tobytes()).decode()
        for name in dict.fromkeys(names)
    }


# Measures drawn over the snapshots by SI unit, with the caption of their chart.
OVER_TIME = {
    "m": (("crater_diameter", "penetration", "extension"), "Lengths"),
    "m/s": (("residual_velocity", "plug_velocity"), "Velocities"),
}
TOUCHED = 1e-4  # share of the kinetic energy that is lost at contact


def history_charts(history: Mapping[str, np.ndarray], unitless: bool) -> tuple[Charts, Charts]:
    """Return charts of measured quantities over time, and of the run's conservation."""
    time = np.asarray(history["time"], float)
    if len(time) < 2:
        return [], []
    giga = 1.0 if unitless else 1e-9
    measured = []
    pressures = {"centre_pressure": "at the projectile's centre", "axis_pressure_min": "lowest on the shot line"}
    curves = {label: history[name] * giga for name, label in pressures.items() if name in history}
    if curves:
        measured.append(chart(time, curves, "pressure" if unitless else "pressure [GPa]", "Pressures", unitless))
    conserved = []
    energies = [name for name in history if name.endswith(("_energy", "_work", "_heat")) or name == "energy"]
    if energies:
        lines = {name.replace("_", " "): history[name] for name in energies}
        conserved.append(_scaled_chart(time, lines, "energy", "kJ", "Energies by kind", unitless))
    if "energy_drift" in history:
        drift = history["energy_drift"] * 100.0
        conserved.append(chart(time, {"drift": drift}, "drift [%]", "Drift of the total energy", unitless))
    if "dt" in history:
        step = history["dt"][1:]
        conserved.append(_scaled_chart(time[1:], {"step": step}, "step", "ns", "Time step", unitless))
    return measured, conserved


def _scaled_chart(
    time: np.ndarray,
    lines: Mapping[str, np.ndarray],
    name: str,
    unit: str,
    caption: str,
    unitless: bool,
    bands: Mapping[str, np.ndarray] | None = None,
) -> dict[str, str]:
    """Return a chart of lines [SI] in `unit`, or in the unit that suits their size."""
    word, factor = ("", 1.0) if unitless else axis_unit(unit, np.concatenate(list(lines.values())))
    scaled, spread = ({label: values * factor for label, values in part.items()} for part in (lines, bands or {}))
    return chart(time, scaled, f"{name} [{word}]" if word else name, caption, unitless, spread)


def measured_charts(measured: Measures) -> Charts:
    """Return charts of the main measures over the snapshots, with their bands: lengths, and velocities."""
    series = measured.series
    time = np.array([moment.time for moment in series])
    charts = []
    for unit, (names, caption) in OVER_TIME.items():
        lines, bands = {}, {}
        for name in names:
            results = [moment.results.get(name) for moment in series]
            display = format_of(name, unit, measured.unitless)
            values = np.array([_or_nan(result.value if result else None) for result in results])
            if np.isfinite(values).sum() > 1:
                lines[display.label] = values
                bands[display.label] = np.array([_or_nan(result.uncertainty if result else None) for result in results])
        if lines:
            shown_in = format_of(names[0], unit).unit
            charts.append(_scaled_chart(time, lines, caption.lower(), shown_in, caption, measured.unitless, bands))
    return charts


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def moments(
    history: Mapping[str, np.ndarray], last: Snapshot, measures: PlainMapping, layers: Sequence[PlainMapping] = ()
) -> list[tuple[str, float]]:
    """Return the main moments of a run by name, in order of time [s]."""
    end = last.time
    events: list[tuple[str, object]] = []
    if len(last.bodies) > 1 and "kinetic_energy" in history:  # contact: the first record with less kinetic energy
        energy = history["kinetic_energy"]
        slower = np.flatnonzero(energy < (1.0 - TOUCHED) * energy[:1])
        events.append(("contact", float(np.asarray(history["time"], float)[slower[0]]) if len(slower) else None))
    events.append(("peak pressure", measures.get("centre_pressure_peak", {}).get("time")))
    for layer in layers:
        time = layer["measures"].get("perforation_time", {}).get("value")
        events.append((f"perforation of {layer['body']}", time))
    marks = [("begin", 0.0), *((name, float(t)) for name, t in events if isinstance(t, int | float) and 0.0 < t < end)]
    return [*sorted(marks, key=lambda mark: mark[1]), ("end", end)]


def criteria(history: Mapping[str, np.ndarray]) -> Sequence[tuple[str, float]]:
    """Return the criteria that limited the step, with their shares of the recorded steps."""
    if "criterion" not in history:
        return []
    names, counts = np.unique(np.asarray(history["criterion"], str), return_counts=True)
    order = np.argsort(-counts)
    return [(str(names[k]), float(counts[k] / counts.sum())) for k in order]
