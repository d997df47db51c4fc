"""Pictures of all particles of a run: several moments or runs side by side, from the side, the front or turned."""

from __future__ import annotations

import math
import os
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.fields import CATALOGUE, component_names
from hvisph.output.snapshot import Snapshot

from .camera import RADIUS, SHADES, VIEWS, copies, facing_the_struck_side, revolve, rotate_view, visible_discs
from .history import BODY_COLOURS, appearance, field_range, lengths, store

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PIXELS = 900  # across a picture
WIDTH, TALLEST = 12.0, 8.0  # of a figure, of a panel [in]
STRAY = 0.0005  # share of particles that may lie outside of the picture: single ones fly far
LEAST = 0.96  # of the extent of all that is nevertheless shown
SHARES = ("body", "material")


@dataclass(frozen=True)
class Look:
    """How particles are shown.

    Parameters
    ----------
    field
        ``speed``, ``body``, ``material``, a field, or a component such as ``velocity_x``.
    ends
        Ends of the colour scale in the snapshot's unit; all moments' range less its outermost 0.5 % unless given.
    log
        Whether colours follow the logarithm.
    view
        ``side``, ``front`` or ``3d``, or yaw and pitch [degrees].
    mirrored
        Whether the images at symmetry planes are shown.
    zoom
        Left, right, bottom, top [m]; or how many times larger than all; None for all.
    """

    field: str = "speed"
    ends: tuple[float, float] | None = None
    log: bool = False
    view: str | tuple[float, float] = "side"
    mirrored: bool = True
    zoom: tuple[float, float, float, float] | float | None = None


@dataclass(frozen=True)
class Moment:
    """A snapshot to show.

    Parameters
    ----------
    snapshot
        The state.
    planes
        Axes whose coordinate plane is a mirror of the model.
    name
        Text above the panel.
    """

    snapshot: Snapshot
    planes: tuple[int, ...] = ()
    name: str = ""


def usual_view(moment: Moment) -> str | tuple[float, float]:
    """Return how a moment is seen unless told otherwise: turned in 3D, an oblique plate from where it is struck."""
    state = moment.snapshot
    if state.dimensions < 3:
        return "side"
    if not {"velocity", "mass"} <= set(state.fields):
        return "3d"
    position, velocity = (state.fields[name].reshape(state.count, 3) for name in ("position", "velocity"))
    return facing_the_struck_side(position, velocity, state.fields["mass"], moment.planes) or "3d"


def view_picture(moments: Sequence[Moment], path: str | os.PathLike[str], look: Look) -> Path:
    """Draw moments side by side, on one scale of colours and one of lengths, and store the picture.

    Raises
    ------
    CaseError
        When a snapshot has no such field, or the file's ending is unknown.
    """
    return store(draw(moments, look), path)


def draw(moments: Sequence[Moment], look: Look, ends: tuple[float, float] | None = None,
         extent: tuple[float, float, float, float] | None = None) -> Figure:  # fmt: skip
    """Return the figure of moments; `ends` and `extent` keep scales of other figures."""
    from matplotlib.figure import Figure

    projected = [_project(moment, look) for moment in moments]
    ends = ends or scale_of(moments, look)
    extent = extent or extent_of(projected, moments, look)
    width, height = extent[1] - extent[0], extent[3] - extent[2]
    count = len(moments)
    across = max(1, min(count, round(math.sqrt(count * 1.4 * height / width)) or 1))
    down = -(-count // across)
    panel = min(WIDTH / across, TALLEST * width / height)
    figure = Figure(figsize=(panel * across + 1.3, panel * height / width * down + 0.55 * down + 0.5), dpi=130,
                    layout="constrained")  # fmt: skip
    axes = np.atleast_1d(figure.subplots(down, across)).ravel()
    for one in axes[count:]:
        one.remove()
    for one, moment, (place, owner) in zip(axes, moments, projected, strict=False):
        _panel(one, moment, place, owner, look, ends, extent)
    _legend(figure, axes[:count], moments, look, ends)
    titles = dict.fromkeys(str(moment.snapshot.metadata.get("title", "")) for moment in moments)
    if len(titles) == 1:
        figure.suptitle(textwrap.fill(next(iter(titles)), max(int(11 * figure.get_figwidth()), 30)), fontsize=10)
    return figure


def thumbnail(moment: Moment, look: Look, ends: tuple[float, float], width: int) -> np.ndarray:
    """Return a small picture of a moment without axes: RGB from 0 to 1, shape (height, width, 3), the top row first."""
    projected = _project(moment, look)
    return _image(moment.snapshot, *projected, look, ends, extent_of([projected], [moment], look), width)[::-1]


def scale_of(moments: Sequence[Moment], look: Look) -> tuple[float, float]:
    """Return the ends of the colour scale in the unit of pictures."""
    if look.field in SHARES:
        return 0.0, 1.0
    label, factor, _, symmetric = _appearance(moments[0].snapshot, look.field)
    if look.ends is not None:
        return look.ends[0] * factor, look.ends[1] * factor
    values = np.concatenate([field_of(moment.snapshot, look.field) * factor for moment in moments])
    low, high = field_range(values, symmetric and not look.log)
    if look.log:
        positive = values[values > 0.0]
        if not len(positive):
            raise CaseError(f"{label} is nowhere positive: it has no logarithm", where="--log")
        low = max(low, float(np.quantile(positive, 0.02)), 1e-6 * high)
    return low, high


def extent_of(projected: Any, moments: Sequence[Moment], look: Look) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top of pictures that show all moments, or what is zoomed to [m]."""
    if isinstance(look.zoom, tuple):
        return look.zoom
    margin = 2.0 * _spacing(moments[0].snapshot)
    everything = np.concatenate([place[:, :2] for place, _ in projected])
    low = np.min([np.quantile(place[:, :2], STRAY, axis=0) for place, _ in projected], axis=0)
    high = np.max([np.quantile(place[:, :2], 1.0 - STRAY, axis=0) for place, _ in projected], axis=0)
    first, last = everything.min(axis=0), everything.max(axis=0)
    small = high - low < LEAST * (last - first)
    low, high = np.where(small, first, low) - margin, np.where(small, last, high) + margin
    middle, half = 0.5 * (low + high), 0.5 * (high - low) / (look.zoom or 1.0)
    return (float(middle[0] - half[0]), float(middle[0] + half[0]),
            float(middle[1] - half[1]), float(middle[1] + half[1]))  # fmt: skip


def field_of(snapshot: Snapshot, field: str) -> np.ndarray:
    """Return a field, a component of one, or the speed, in SI, shape (n,)."""
    name = "velocity" if field == "speed" else field
    if name in snapshot.fields:
        values = snapshot.fields[name].reshape(snapshot.count, -1)
        return values[:, 0] if values.shape[1] == 1 else np.sqrt((values**2).sum(axis=1))
    for whole in snapshot.fields:
        if whole in CATALOGUE and name in (columns := component_names(whole, snapshot.dimensions)):
            return snapshot.fields[whole].reshape(snapshot.count, -1)[:, columns.index(name)]
    allowed = ["speed", *SHARES, *snapshot.fields]
    raise CaseError(f"the snapshot has no field '{field}'{suggest_nearest(field, allowed)}", where="--field")


def _appearance(snapshot: Snapshot, field: str) -> tuple[str, float, str, bool]:
    if field == "speed":
        return appearance(snapshot, "velocity")
    for whole in snapshot.fields:
        if field != whole and whole in CATALOGUE and field in component_names(whole, snapshot.dimensions):
            label, factor, _, _ = appearance(snapshot, whole)
            return f"{field} {label[label.find('[') :]}" if "[" in label else field, factor, "RdBu_r", True
    return appearance(snapshot, field)


def _project(moment: Moment, look: Look) -> tuple[np.ndarray, np.ndarray]:
    """Return places (m, 3) of all discs, and the particle that each is of."""
    position = moment.snapshot.fields["position"].reshape(moment.snapshot.count, -1)
    yaw, pitch = VIEWS[look.view] if isinstance(look.view, str) else look.view
    rings = moment.snapshot.is_axisymmetric
    if rings and look.view != "side":
        place, owner = revolve(position, _spacing(moment.snapshot), 270.0 if look.mirrored else 180.0)
    else:
        planes = (1,) if rings else moment.planes
        place, owner = copies(position, planes if look.mirrored else ())
    return rotate_view(place, yaw, pitch), owner


def _panel(axes: Axes, moment: Moment, place: np.ndarray, owner: np.ndarray, look: Look,
           ends: tuple[float, float], extent: tuple[float, float, float, float]) -> None:  # fmt: skip
    image = _image(moment.snapshot, place, owner, look, ends, extent, PIXELS)
    unit, factor = lengths(moment.snapshot, extent)
    left, right, bottom, top = (end * factor for end in extent)
    axes.imshow(image, origin="lower", extent=(left, right, bottom, top), interpolation="none")
    side = "r" if moment.snapshot.is_axisymmetric else "y"
    across, up = ("x", side) if look.view == "side" else ("across", "up")
    axes.set_xlabel(f"{across}{unit}")
    axes.set_ylabel(f"{up}{unit}")
    axes.set_title(moment.name, fontsize=9)


def _image(snapshot: Snapshot, place: np.ndarray, owner: np.ndarray, look: Look, ends: tuple[float, float],
           extent: tuple[float, float, float, float], width: int) -> np.ndarray:  # fmt: skip
    """Return what is seen, RGB from 0 to 1, `width` pixels across, the lowest row first."""
    sight = visible_discs(place, RADIUS * _spacing(snapshot), extent, width)
    colours = _colours(snapshot, look, ends)[owner]
    image = np.ones((*sight.index.shape, 3))
    there = sight.index >= 0
    bright = SHADES[0] + (SHADES[1] - SHADES[0]) * sight.shade if place[:, 2].any() else np.ones_like(sight.shade)
    image[there] = colours[sight.index[there]] * bright[there, None]
    return image


def _colours(snapshot: Snapshot, look: Look, ends: tuple[float, float]) -> np.ndarray:
    """Return the colour of each particle, RGB from 0 to 1, shape (n, 3)."""
    from matplotlib import colormaps
    from matplotlib.colors import LogNorm, Normalize, to_rgb

    if look.field in SHARES:
        number = snapshot.body if look.field == "body" else snapshot.material
        table = np.array([to_rgb(colour) for colour in BODY_COLOURS])
        return table[number % len(table)]
    _, factor, colours, _ = _appearance(snapshot, look.field)
    norm = (LogNorm if look.log else Normalize)(*ends, clip=True)
    values = np.ma.filled(norm(field_of(snapshot, look.field) * factor), 0.0)
    return colormaps[colours](values)[:, :3]


def _legend(figure: Figure, axes: Any, moments: Sequence[Moment], look: Look, ends: tuple[float, float]) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.lines import Line2D

    first = moments[0].snapshot
    if look.field in SHARES:
        names = first.bodies if look.field == "body" else first.materials
        marks = [Line2D([], [], ls="", marker="o", color=BODY_COLOURS[k % len(BODY_COLOURS)], label=name)
                 for k, name in enumerate(names)]  # fmt: skip
        axes[0].legend(handles=marks, fontsize=8, loc="upper left")
        return
    label, _, colours, _ = _appearance(first, look.field)
    norm = (LogNorm if look.log else Normalize)(*ends)
    figure.colorbar(ScalarMappable(norm, colours), ax=list(axes), label=label, shrink=0.8, extend="both")


def _spacing(snapshot: Snapshot) -> float:
    if "spacing" in snapshot.metadata:
        return float(snapshot.metadata["spacing"])
    volume = np.median(snapshot.fields["mass"] / snapshot.fields["density"])
    return float(volume ** (1.0 / snapshot.dimensions))
