"""Fragments as text for people: a list a body, or how they develop."""

from __future__ import annotations

import math
from typing import Any

from hvisph.core.measure_catalogue import axis_unit

from .formatting import paragraph, table, times

# unit for people and factor from SI, by the unit of the mass
MASSES = {"kg": ("g", 1e3), "kg/m": ("kg/m", 1.0), "kg/m^2": ("kg/m^2", 1.0)}


def fragments_text(moment: Any, fewest: int) -> str:
    """Return what the bodies of one moment have broken into.

    Parameters
    ----------
    moment
        `hvisph.measures.measure.Measures`.
    fewest
        Particles of a fragment that is listed; smaller ones are summed up in one line.
    """
    return "\n\n".join(_body(part, moment, fewest) for part in moment.fragments)


def fragments_series(series: Any, fewest: int) -> str:
    """Return for every body one line a moment."""
    plain = series[-1].unitless
    speed = "" if plain else "m/s"
    head = [
        ["t", "fragments", f"of {fewest}+", "largest", "its v_x", "its speed", f"below {fewest}", "single"],
        ["", "", "particles", "% of mass", speed, speed, "% of mass", "% of mass"],
    ]
    moments = times([moment.time for moment in series], "" if plain else "s")
    blocks = []
    for name in dict.fromkeys(part.body for moment in series for part in moment.fragments):
        lines = [
            [
                time,
                str(len(part)),
                str(part.number(fewest)),
                _percent(part.share([0])),
                _figure(part.fragments[0].velocity[0]),
                _figure(part.fragments[0].speed),
                _percent(part.share(part.counts < fewest)),
                _percent(part.share(part.counts == 1)),
            ]
            for time, moment in zip(moments, series, strict=True)
            for part in moment.fragments
            if part.body == name
        ]
        blocks.append(f"{name}\n{table([*head, *lines])}")
    return "\n\n".join(blocks)


def _body(part: Any, moment: Any, fewest: int) -> str:
    plain, axes = moment.unitless, "xyz"[: moment.dimensions]
    unit, factor = ("", 1.0) if plain else MASSES[moment.mass_unit]
    listed = [fragment for fragment in part.fragments if fragment.count >= fewest]
    sizes = [float(value) for piece in listed for value in (*piece.centre, *piece.extent)]
    measure, length = ("", 1.0) if plain else axis_unit("mm", sizes)
    speeds = ["" if plain else "m/s"] * (len(axes) + 1)
    lengths = [measure] * (2 * len(axes))
    lines = [
        ["", "particles", "mass", "share", *(f"v_{axis}" for axis in axes), "speed", *axes]
        + [f"extent {axis}" for axis in axes],
        ["", "", unit, "%", *speeds, *lengths],
    ]
    columns = [
        *_columns([[*piece.velocity, piece.speed] for piece in listed]),
        *_columns([[length * value for value in piece.centre] for piece in listed]),
        *_columns([[length * value for value in piece.extent] for piece in listed]),
    ]
    for row, piece in enumerate(listed):
        mass, share = _figure(factor * piece.mass), _percent(part.share([row]))
        figures = [column[row] for column in columns]
        lines.append([str(row + 1), str(piece.count), mass, share, *figures, part.roles[row]])
    shown = [paragraph(_summary(part, unit, factor), hanging=2), *([table(lines)] if listed else [])]
    small = part.counts < fewest
    if small.any():
        rest = f"{small.sum()} of fewer than {fewest} particles: {part.counts[small].sum()} particles"
        shown.append(f"  {rest}{_mass(part, small, unit, factor)}")
    return "\n".join(shown)


def _summary(part: Any, unit: str, factor: float) -> str:
    many, single = len(part), part.counts == 1
    text = f"{part.body}: {many} fragment{'s' if many > 1 else ''} of {part.counts.sum()} particles"
    if math.isfinite(part.mass):
        text += f", {_figure(factor * part.mass)} {unit}".rstrip()
        text += f"; the largest, {part.counts[0]} particles, holds {_percent(part.share([0]))} %"
    if single.any():
        text += f"; {single.sum()} single particle{'s' if single.sum() > 1 else ''}{_mass(part, single, unit, factor)}"
    return text


def _mass(part: Any, chosen: Any, unit: str, factor: float) -> str:
    mass = part.masses[chosen].sum()
    if not math.isfinite(mass):
        return ""
    return f", {_figure(factor * mass)} {unit}".rstrip() + f", {_percent(part.share(chosen))} % of the mass"


def _percent(share: float) -> str:
    """Return a share in per cent; small ones keep two figures."""
    if not math.isfinite(share):
        return "-"
    return f"{100.0 * share:.2g}" if 0.0 < share < 0.001 else f"{100.0 * share:.2f}"


def _columns(rows: list[list[float]]) -> list[list[str]]:
    """Return the columns of numbers of one kind, with as many decimals as give the largest four figures."""
    scale = max((abs(value) for row in rows for value in row if math.isfinite(value)), default=0.0)
    decimals = max(0, 3 - math.floor(math.log10(scale))) if scale > 0.0 else 0
    return [[_figure(value, f".{decimals}f") for value in column] for column in zip(*rows, strict=True)]


def _figure(value: float, form: str = ".4g") -> str:
    if not math.isfinite(value):
        return "-"
    text = f"{value:{form}}"
    return text if float(text) else text.lstrip("-")  # what rounds to nothing has no sign
