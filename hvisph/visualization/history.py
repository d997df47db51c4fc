"""Pictures of snapshots and histories."""

from __future__ import annotations

import os
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.measure_catalogue import axis_unit, format_time
from hvisph.measures.frame.measurement_frame import Scene
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
OUTSIDE = 0.005  # share of particles that a colour scale may leave beyond each of its ends


def picture(
    snapshot: Snapshot,
    path: str | os.PathLike[str],
    field: str = "pressure",
    limits: tuple[float, float] | None = None,
) -> Path:
    """Draw the particles of a 2D snapshot, or of a slice of a 3D one, and store it.

    Particles are discs of diameter sqrt(2) dx in the data's own scale, coloured by `field` and edged in
    their body's colour. The slice is what lies within dx of the plane through the shot line. 1D snapshots
    are drawn as a profile of the field.

    Parameters
    ----------
    snapshot
        The moment to draw.
    path
        File to write; its ending tells the format.
    field
        A field of the snapshot, or ``body``. Vectors are drawn by their magnitude.
    limits
        Ends of the colour scale in the snapshot's unit; by default the field's range less its outermost 0.5 %.

    Raises
    ------
    CaseError
        When the snapshot has no such field.
    """
    from matplotlib.figure import Figure

    scene = Scene(snapshot)
    shown = np.arange(snapshot.count)
    if snapshot.dimensions == 3:
        shown = np.flatnonzero(np.abs(scene.lateral[:, 1]) < scene.spacing)
    x = scene.position[shown, :2]
    if snapshot.dimensions == 1:
        figure = Figure(figsize=(8.0, 4.5), dpi=150, layout="constrained")
        axes = figure.add_subplot()
        draw_profile(axes, snapshot, field)
    else:
        span = np.ptp(x, axis=0) + 4.0 * scene.spacing if len(x) else np.ones(2)
        height = 7.0
        width = float(np.clip(height * span[0] / span[1] + 1.9, 4.2, 13.0))
        figure = Figure(figsize=(width, height), dpi=150, layout="constrained")
        axes = figure.add_subplot()
        draw_particles(axes, scene, shown, field, limits)
    figure.suptitle(_title(snapshot, int(13 * figure.get_figwidth())), fontsize=9)
    return store(figure, path)


def draw_particles(
    axes: Axes,
    scene: Scene,
    shown: np.ndarray,
    field: str,
    limits: tuple[float, float] | None = None,
    bare: bool = False,
    shared: tuple[str, float] | None = None,
) -> Any:
    """Draw the particles `shown` (indices) of a scene into `axes`, with a colour bar and a legend.

    With `bare`, the two are left to the caller, who gets what a colour bar is made from: None for bodies. `shared` is
    the unit of lengths that several have in common, as of `lengths`.
    """
    from matplotlib.collections import EllipseCollection

    snapshot = scene.now
    unit, metres = shared or lengths(snapshot, scene.position[shown, :2])
    x = scene.position[shown, :2] * metres
    spacing = scene.spacing * metres
    size = np.full(len(shown), DISC * spacing)
    body = snapshot.body[shown]
    edges = [BODY_COLOURS[index % len(BODY_COLOURS)] for index in body]
    look: dict[str, Any] = {"units": "xy", "offsets": x, "transOffset": axes.transData}
    # wider discs in the body's colour underneath: neighbours cover them but for the body's outline
    reach = float(np.ptp(x, axis=0).max()) if len(x) else 0.0
    wide = size + max(0.3 * spacing, 0.005 * reach)
    discs = None
    rims = EllipseCollection(wide, wide, 0.0 * size, facecolors=edges, lw=0.0, **look)
    axes.add_collection(rims)
    if field == "body":
        axes.add_collection(EllipseCollection(size, size, 0.0 * size, facecolors=edges, lw=0.0, **look))
    else:
        values, label, colours, symmetric = field_values(snapshot, field)
        discs = EllipseCollection(size, size, 0.0 * size, array=values[shown], cmap=colours, lw=0.0, **look)
        factor = appearance(snapshot, field)[1]
        low, high = (limits[0] * factor, limits[1] * factor) if limits else field_range(values[shown], symmetric)
        discs.set_clim(low, high)
        axes.add_collection(discs)
        if not bare:
            open_ends = colour_bar_extension(values[shown], low, high)
            axes.figure.colorbar(discs, ax=axes, label=label, shrink=0.85, pad=0.03, extend=open_ends)
    marks = [] if bare else body_marks(snapshot, body)
    place: dict[str, Any] = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "borderaxespad": 0.2}
    if marks:
        axes.legend(handles=marks, ncols=min(len(marks), 3), fontsize=8, frameon=False, **place)
    axes.set_aspect("equal")
    if len(x):
        start, end = x.min(axis=0), x.max(axis=0)
        margin = 0.03 * reach + float(size[0])
        axes.set_xlim(start[0] - margin, end[0] + margin)
        axes.set_ylim(start[1] - margin, end[1] + margin)
    axes.set_xlabel(f"x{unit}")
    axes.set_ylabel(f"{'r' if snapshot.is_axisymmetric else 'y'}{unit}")
    return discs


def body_marks(snapshot: Snapshot, body: np.ndarray) -> list[Any]:
    """Return the entries of a legend for the bodies whose indices occur in `body`."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], ls="", marker="o", ms=6, color=BODY_COLOURS[index % len(BODY_COLOURS)], label=name)
        for index, name in enumerate(snapshot.bodies)
        if (body == index).any()
    ]


def draw_profile(axes: Axes, snapshot: Snapshot, field: str) -> None:
    """Draw a field of a 1D snapshot over x into `axes`, a line for each body."""
    values, label, _, _ = field_values(snapshot, field)
    x = snapshot.fields["position"].reshape(snapshot.count, -1)[:, 0]
    unit, factor = lengths(snapshot, x)
    x = x * factor
    for index, name in enumerate(snapshot.bodies):
        own = np.flatnonzero(snapshot.body == index)
        own = own[np.argsort(x[own])]
        axes.plot(x[own], values[own], ".-", ms=2, lw=0.9, color=BODY_COLOURS[index % 6], label=name)
    axes.set_xlabel(f"x{unit}")
    axes.set_ylabel(label)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def store(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure beside and rename it; the ending of `path` tells the format."""
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
    """Return label, factor from the snapshot's own unit, colour map, and whether zero is its middle."""
    label, factor, colours, symmetric = LOOK.get(field, (field.replace("_", " "), 1.0, "viridis", False))
    if _unitless(snapshot):
        label, factor = label.partition(" [")[0], 1.0
    return label, factor, colours, symmetric


def _unitless(snapshot: Snapshot) -> bool:
    return snapshot.metadata.get("units") == "none"


def field_values(snapshot: Snapshot, field: str) -> tuple[np.ndarray, str, str, bool]:
    """Return a field in the unit of pictures (n,), label, colour map, and whether zero is its middle."""
    if field not in snapshot.fields:
        allowed = ["body", *snapshot.fields]
        raise CaseError(f"the snapshot has no field '{field}'{suggest_nearest(field, allowed)}", where="field")
    values = snapshot.fields[field].reshape(snapshot.count, -1)
    magnitude = np.sqrt((values**2).sum(axis=1)) if values.shape[1] > 1 else values[:, 0]
    label, factor, colours, symmetric = appearance(snapshot, field)
    return magnitude * factor, label, colours, symmetric


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


def colour_bar_extension(values: np.ndarray, low: float, high: float) -> Literal["neither", "min", "max", "both"]:
    """Which ends of a colour bar are open: those that values lie beyond."""
    under, over = bool((values < low).any()), bool((values > high).any())
    return "both" if under and over else "min" if under else "max" if over else "neither"


def _title(snapshot: Snapshot, width: int) -> str:
    title = textwrap.fill(str(snapshot.metadata.get("title", "")), width)
    moment = f"t = {snapshot.time:.4g}" if _unitless(snapshot) else f"t = {format_time(snapshot.time, '.2f')}"
    return f"{title}\n{moment}" if title else moment
