"""Pictures embedded in a page: charts as SVG, colour maps as tables."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hvisph.core.measure_catalogue import axis_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_POINTS = 400  # of a line
COLOURS = 256  # of a colour map


def chart(time: np.ndarray, lines: Mapping[str, np.ndarray], unit: str, caption: str, unitless: bool,
          bands: Mapping[str, np.ndarray] | None = None) -> dict[str, str]:  # fmt: skip
    """Return a chart of lines over time: its SVG and its caption.

    Parameters
    ----------
    time
        Shape (n,) [s].
    lines
        Values by label, each (n,), in `unit`.
    unit
        Of the values, for the axis.
    caption
        What it shows.
    unitless
        Whether the case has no units.
    bands
        What lines are uncertain by, each (n,), by their labels: drawn as bands, and the values as marks.
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
            (line,) = axes.plot(time[thin] * factor, values[thin], label=label, linewidth=1.3,
                                marker="" if spread is None else ".")  # fmt: skip
            if spread is not None:
                low, high = (values + sign * np.nan_to_num(spread) for sign in (-1.0, 1.0))
                axes.fill_between(time[thin] * factor, low[thin], high[thin], color=line.get_color(), alpha=0.2, lw=0)
        axes.set_xlabel("time" if unitless else f"time [{word.replace('us', 'µs')}]")
        axes.set_ylabel(unit)
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
