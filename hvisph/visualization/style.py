"""Labels, units, colours and files of pictures."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.fields import CATALOGUE, component_names
from hvisph.core.measure_catalogue import axis_unit
from hvisph.output.atomic_write import replacing
from hvisph.output.snapshot import Snapshot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# field: (label, factor from SI, colour map, symmetric about zero)
LOOK: dict[str, tuple[str, float, str, bool]] = {
    "pressure": ("pressure [GPa]", 1e-9, "RdBu_r", True),
    "von_mises_stress": ("von Mises stress [GPa]", 1e-9, "viridis", False),
    "plastic_strain": ("equivalent plastic strain [-]", 1.0, "magma", False),
    "damage": ("damage [-]", 1.0, "magma", False),
    "temperature": ("temperature [K]", 1.0, "inferno", False),
    "density": ("density [kg/m$^3$]", 1.0, "viridis", False),
    "internal_energy": ("internal energy [kJ/kg]", 1e-3, "inferno", False),
    "velocity": ("speed [m/s]", 1.0, "viridis", False),
}
BODY_COLOURS = ("#1b4f72", "#b9770e", "#1e8449", "#6c3483", "#922b21", "#515a5a")
DISC = 2.0**0.5  # diameter in spacings: discs about the cells of the lattice, so that sound bodies are closed
SHARES = ("body", "material")  # fields coloured by number
OUTSIDE = 0.005  # share of particles that a colour scale may leave beyond each of its ends


def body_colour(number: int) -> str:
    """Return the colour of a body or material by its number."""
    return BODY_COLOURS[number % len(BODY_COLOURS)]


def new_figure(size: tuple[float, float], dpi: int = 110) -> Figure:
    """Return an empty figure of a size [in]."""
    from matplotlib.figure import Figure

    return Figure(figsize=size, dpi=dpi, layout="constrained")


def new_panels(count: int, columns: int, size: tuple[float, float], dpi: int = 110) -> tuple[Figure, list[Axes]]:
    """Return a figure with `count` panels, up to `columns` beside one another, each of a size [in]."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure = new_figure((size[0] * columns, size[1] * rows + 0.5), dpi)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel in axes[count:]:
        panel.remove()
    return figure, list(axes[:count])


def store(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure to `path`, completely or not at all; its ending is the format."""
    target = Path(path)
    ending = target.suffix.lstrip(".").lower() or "png"
    allowed = sorted(figure.canvas.get_supported_filetypes())
    if ending not in allowed:
        raise CaseError(f"{target}: pictures cannot be stored as '{ending}'{suggest_nearest(ending, allowed)}")
    with replacing(target) as file:
        figure.savefig(file, format=ending, bbox_inches="tight", pad_inches=0.12)
    return target


def lengths(snapshot: Snapshot, places: Any) -> tuple[str, float]:
    """Return the unit of lengths in a picture of `places` as an axis shows it, and the factor from the snapshot's."""
    if _unitless(snapshot):
        return "", 1.0
    unit, factor = axis_unit("mm", np.ravel(places)[:: max(1, np.size(places) // 10_000)])
    return f" [{unit}]", factor


def appearance(snapshot: Snapshot, field: str) -> tuple[str, float, str, bool]:
    """Return label, factor from the own unit, colour map, and whether zero is its middle, of a field or component."""
    name = "velocity" if field == "speed" else field
    vector = next((f for f in snapshot.fields if name in _components(snapshot, f)), name)
    label, factor, colours, symmetric = LOOK.get(vector, (vector.replace("_", " "), 1.0, "viridis", False))
    if vector != name:
        label = f"{field} {label[label.find('[') :]}" if "[" in label else field
        colours, symmetric = "RdBu_r", True
    if _unitless(snapshot):
        label, factor = label.partition(" [")[0], 1.0
    return label, factor, colours, symmetric


def field_of(snapshot: Snapshot, field: str) -> np.ndarray:
    """Return a field (of vectors the magnitude), a component or the speed (n,) in SI; `CaseError` if there is none."""
    name = "velocity" if field == "speed" else field
    if name in snapshot.fields:
        values = snapshot.fields[name].reshape(snapshot.count, -1)
        return values[:, 0] if values.shape[1] == 1 else np.sqrt((values**2).sum(axis=1))
    for vector in snapshot.fields:
        if name in (columns := _components(snapshot, vector)):
            return snapshot.fields[vector].reshape(snapshot.count, -1)[:, columns.index(name)]
    allowed = ["speed", *SHARES, *snapshot.fields]
    raise CaseError(f"the snapshot has no field '{field}'{suggest_nearest(field, allowed)}", where="--field")


def _components(snapshot: Snapshot, field: str) -> Sequence[str]:
    names = component_names(field, snapshot.dimensions) if field in CATALOGUE else ()
    return () if field in names else names


def _unitless(snapshot: Snapshot) -> bool:
    return snapshot.metadata.get("units") == "none"


def field_range(values: np.ndarray, symmetric: bool, outside: float = OUTSIDE) -> tuple[float, float]:
    """Return the ends of a colour scale: the range of `values` less its outermost share."""
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return 0.0, 1.0
    low, high = (float(end) for end in np.quantile(finite, [outside, 1.0 - outside]))
    if symmetric:
        top = max(abs(low), abs(high))
        low, high = -top, top
    return (low, high) if high > low else (low - 0.5, low + 0.5)
