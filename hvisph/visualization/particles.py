"""Pictures and animations of all particles: moments or runs side by side, in any view."""

from __future__ import annotations

import math
import os
import shutil
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.measures.impact_geometry import spacing_of
from hvisph.output.atomic_write import replacing
from hvisph.output.snapshot import Snapshot

from .camera import RADIUS, SHADES, VIEWS, copies, facing_the_struck_side, revolve, rotate_view, visible_discs
from .style import OUTSIDE, SHARES, appearance, body_colour, field_of, field_range, lengths, new_figure, store

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from PIL.Image import Image


Ends = tuple[float, float]  # of a scale of colours, in the unit of pictures
Extent = tuple[float, float, float, float]  # left, right, bottom, top of a picture [m]
Projected = tuple[np.ndarray, np.ndarray]  # places (m, 3) of discs, and the particle that each is of
PIXELS = 900  # across a picture
MOST = 40  # panels
WIDTH, TALLEST = 12.0, 8.0  # of a figure, of a panel [in]
STRAY = 0.0005  # share of particles that may lie outside of the picture: single ones fly far
LEAST = 0.96  # of the extent of all that is nevertheless shown


@dataclass(frozen=True)
class Look:
    """Appearance of particles."""

    field: str = "speed"  # ``speed``, ``body``, ``material``, a field, or a component such as ``velocity_x``
    # ends of the colour scale in the snapshot's unit; all moments' range less its outermost 0.5 % unless given
    ends: tuple[float, float] | None = None
    log: bool = False  # whether colours follow the logarithm
    view: str | tuple[float, float] = "side"  # ``side``, ``front`` or ``3d``, or yaw and pitch [degrees]
    mirrored: bool = True  # whether the images at symmetry planes are shown
    # left, right, bottom, top [m]; or how many times larger than all; None for all
    zoom: tuple[float, float, float, float] | float | None = None


@dataclass(frozen=True)
class Moment:
    """A snapshot to show."""

    snapshot: Snapshot  # the state
    planes: tuple[int, ...] = ()  # axes whose coordinate plane is a mirror of the model
    name: str = ""  # text above the panel


def usual_view(moment: Moment) -> str | tuple[float, float]:
    """Return the default view of a moment: in 3D turned, towards the struck face of an oblique plate."""
    state = moment.snapshot
    if state.dimensions < 3:
        return "side"
    if not {"velocity", "mass"} <= set(state.fields):
        return "3d"
    position, velocity = (state.fields[name].reshape(state.count, 3) for name in ("position", "velocity"))
    return facing_the_struck_side(position, velocity, state.fields["mass"], moment.planes) or "3d"


def view_picture(moments: Sequence[Moment], path: str | os.PathLike[str], look: Look) -> Path:
    """Draw moments side by side, on one scale of colours and one of lengths, and store the picture.

    In 1D a picture shows the field over x. Raises `CaseError` when a snapshot has no such field, their dimensions
    differ, there are too many, or the file's ending is unknown.
    """
    return store(draw(moments, look), path)


def draw(moments: Sequence[Moment], look: Look, ends: Ends | None = None, extent: Extent | None = None) -> Figure:
    """Return the figure of moments; `ends` and `extent` keep scales of other figures."""
    count, dimensions = len(moments), {moment.snapshot.dimensions for moment in moments}
    if len(dimensions) > 1 or count > MOST:
        reason = "runs of different dimensions have no axes in common" if count <= MOST else f"more than {MOST} panels"
        raise CaseError(f"these cannot be drawn in one picture: {reason}")
    projected = [_project(moment, look) for moment in moments]
    ends = ends or scale_of(moments, look)
    extent = extent or extent_of(projected, moments, look)
    curves = dimensions == {1} and look.field not in SHARES
    width, height = (3.0, 1.0) if curves else (extent[1] - extent[0], extent[3] - extent[2])
    columns = max(1, min(count, round(math.sqrt(count * 1.4 * height / width)) or 1))
    rows = -(-count // columns)
    panel = min(WIDTH / columns, TALLEST * width / height)
    figure = new_figure((panel * columns + 1.3, panel * height / width * rows + 0.55 * rows + 0.5), 130)
    axes = np.atleast_1d(figure.subplots(rows, columns)).ravel()
    for panel_axes in axes[count:]:
        panel_axes.remove()
    for axis, moment, (place, owner) in zip(axes, moments, projected, strict=False):
        if curves:
            _profile(axis, moment, look, ends, extent)
        else:
            image = _image(moment.snapshot, (place, owner), look, ends, extent, PIXELS)
            unit, factor = lengths(moment.snapshot, extent)
            left, right, bottom, top = (end * factor for end in extent)
            axis.imshow(image, origin="lower", extent=(left, right, bottom, top), interpolation="none")
            side = "r" if moment.snapshot.is_axisymmetric else "y"
            names = ("x", side) if look.view == "side" else ("across", "up")
            axis.set(xlabel=f"{names[0]}{unit}", ylabel=f"{names[1]}{unit}")
            axis.set_title(moment.name, fontsize=9)
    if not curves:
        _legend(figure, axes[:count], moments, look, ends)
    titles = dict.fromkeys(str(moment.snapshot.metadata.get("title", "")) for moment in moments)
    if len(titles) == 1:
        figure.suptitle(textwrap.fill(next(iter(titles)), max(int(11 * figure.get_figwidth()), 30)), fontsize=10)
    return figure


def thumbnail(moment: Moment, look: Look, ends: Ends, width: int) -> np.ndarray:
    """Return a small picture of a moment without axes: RGB from 0 to 1, shape (height, width, 3), the top row first."""
    projected = _project(moment, look)
    return _image(moment.snapshot, projected, look, ends, extent_of([projected], [moment], look), width)[::-1]


def scale_of(moments: Sequence[Moment], look: Look) -> Ends:
    """Return the ends of the colour scale in the unit of pictures."""
    if look.field in SHARES:
        return 0.0, 1.0
    label, factor, _, symmetric = appearance(moments[0].snapshot, look.field)
    if look.ends is not None:
        return look.ends[0] * factor, look.ends[1] * factor
    values = np.concatenate([field_of(moment.snapshot, look.field) * factor for moment in moments])
    curve = moments[0].snapshot.dimensions == 1  # which is shown whole
    low, high = field_range(values, symmetric and not look.log and not curve, 0.0 if curve else OUTSIDE)
    if look.log:
        positive = values[values > 0.0]
        if not len(positive):
            raise CaseError(f"{label} is nowhere positive: it has no logarithm", where="--log")
        low = max(low, float(np.quantile(positive, 0.02)), 1e-6 * high)
    return low, high


def extent_of(projected: Sequence[Projected], moments: Sequence[Moment], look: Look) -> Extent:
    """Return left, right, bottom and top of pictures of all moments, or of the zoomed region [m]."""
    if isinstance(look.zoom, tuple):
        return look.zoom
    margin = 2.0 * spacing_of(moments[0].snapshot)
    everything = np.concatenate([place[:, :2] for place, _ in projected])
    low = np.min([np.quantile(place[:, :2], STRAY, axis=0) for place, _ in projected], axis=0)
    high = np.max([np.quantile(place[:, :2], 1.0 - STRAY, axis=0) for place, _ in projected], axis=0)
    first, last = everything.min(axis=0), everything.max(axis=0)
    small = high - low < LEAST * (last - first)
    low, high = np.where(small, first, low) - margin, np.where(small, last, high) + margin
    middle, half = 0.5 * (low + high), 0.5 * (high - low) / (look.zoom or 1.0)
    (left, bottom), (right, top) = (middle - half).tolist(), (middle + half).tolist()
    return left, right, bottom, top


def _project(moment: Moment, look: Look) -> Projected:
    """Return places (m, 3) of all discs, and the particle that each is of."""
    position = moment.snapshot.fields["position"].reshape(moment.snapshot.count, -1)
    yaw, pitch = VIEWS[look.view] if isinstance(look.view, str) else look.view
    axisymmetric = moment.snapshot.is_axisymmetric
    if axisymmetric and look.view != "side":
        place, owner = revolve(position, spacing_of(moment.snapshot), 270.0 if look.mirrored else 180.0)
    else:
        planes = (1,) if axisymmetric else moment.planes
        place, owner = copies(position, planes if look.mirrored else ())
    return rotate_view(place, yaw, pitch), owner


def _profile(axes: Axes, moment: Moment, look: Look, ends: tuple[float, float], extent: Extent) -> None:
    """Draw a field of a 1D moment over x, a line for each body."""
    snapshot = moment.snapshot
    unit, metres = lengths(snapshot, extent[:2])
    label, factor, *_ = appearance(snapshot, look.field)
    x, values = snapshot.fields["position"].ravel() * metres, field_of(snapshot, look.field) * factor
    for number, name in enumerate(snapshot.bodies):
        members = np.flatnonzero(snapshot.body == number)
        members = members[np.argsort(x[members])]
        axes.plot(x[members], values[members], ".-", ms=2, lw=0.9, color=body_colour(number), label=name)
    margin = 0.05 * (ends[1] - ends[0])
    axes.set(xlim=(extent[0] * metres, extent[1] * metres), xlabel=f"x{unit}", ylabel=label)
    axes.set_ylim(ends[0] if look.log else ends[0] - margin, ends[1] + margin)
    axes.set_yscale("log" if look.log else "linear")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    axes.set_title(moment.name, fontsize=9)


def _image(state: Snapshot, discs: Projected, look: Look, ends: Ends, extent: Extent, width: int) -> np.ndarray:
    """Return the image, RGB from 0 to 1, `width` pixels across, the lowest row first."""
    place, owner = discs
    sight = visible_discs(place, RADIUS * spacing_of(state), extent, width)
    colours = _colours(state, look, ends)[owner]
    image = np.ones((*sight.index.shape, 3))
    covered = sight.index >= 0
    bright = SHADES[0] + (SHADES[1] - SHADES[0]) * sight.shade if place[:, 2].any() else np.ones_like(sight.shade)
    image[covered] = colours[sight.index[covered]] * bright[covered, None]
    return image


def _colours(snapshot: Snapshot, look: Look, ends: Ends) -> np.ndarray:
    """Return the colour of each particle, RGB from 0 to 1, shape (n, 3)."""
    from matplotlib import colormaps
    from matplotlib.colors import LogNorm, Normalize, to_rgb

    if look.field in SHARES:
        number = snapshot.body if look.field == "body" else snapshot.material
        table = np.array([to_rgb(body_colour(k)) for k in range(int(number.max(initial=0)) + 1)])
        return table[number]
    _, factor, colours, _ = appearance(snapshot, look.field)
    norm = (LogNorm if look.log else Normalize)(*ends, clip=True)
    values = np.ma.filled(norm(field_of(snapshot, look.field) * factor), 0.0)
    return colormaps[colours](values)[:, :3]


def _legend(figure: Figure, axes: np.ndarray, moments: Sequence[Moment], look: Look, ends: Ends) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.lines import Line2D

    first = moments[0].snapshot
    if look.field in SHARES:
        names = first.bodies if look.field == "body" else first.materials
        marks = [Line2D([], [], ls="", marker="o", color=body_colour(k), label=name) for k, name in enumerate(names)]
        axes[0].legend(handles=marks, fontsize=8, loc="upper left")
        return
    label, _, colours, _ = appearance(first, look.field)
    norm = (LogNorm if look.log else Normalize)(*ends)
    figure.colorbar(ScalarMappable(norm, colours), ax=list(axes), label=label, shrink=0.8, extend="both")


FORMATS = (".gif", ".mp4")


def animate(moments: Sequence[Moment], path: str | os.PathLike[str], look: Look, seconds: float = 6.0) -> Path:
    """Draw every moment on one scale and store them as one moving picture.

    `path`: file to write: ``.gif`` or ``.mp4``.
    Raises `CaseError` when the ending is unknown, or ffmpeg is not there for an MP4.
    """
    target = Path(path)
    ending = target.suffix.lower()
    if ending not in FORMATS:
        raise CaseError(f"{target}: no animation is '{ending}'{suggest_nearest(ending, FORMATS)}", where="-o")
    if ending == ".mp4" and shutil.which("ffmpeg") is None:
        raise CaseError("an MP4 needs ffmpeg, which is not installed; write a .gif", where="-o")
    ends = scale_of(moments, look)
    extent = extent_of([_project(moment, look) for moment in moments], moments, look)
    pictures = [_draw_frame(moment, look, ends, extent) for moment in moments]
    pace = max(seconds / len(pictures), 0.04)
    if ending == ".gif":
        images = [picture.quantize(128) for picture in pictures]
        with replacing(target) as file:
            images[0].save(
                file,
                format="GIF",
                save_all=True,
                append_images=images[1:],
                loop=0,
                duration=[int(1000 * pace)] * (len(images) - 1) + [1500],
            )
        return target
    return _film(pictures, target, pace)


def _draw_frame(moment: Moment, look: Look, ends: Ends, extent: Extent) -> Image:
    from PIL.Image import open as open_image

    figure = draw([moment], look, ends, extent)
    figure.set_dpi(90)
    data = BytesIO()
    figure.savefig(data, format="png", dpi=90)
    return open_image(data).convert("RGB")


def _film(pictures: Sequence[Image], target: Path, pace: float) -> Path:
    import subprocess

    width, height = (size - size % 2 for size in pictures[0].size)
    rate = f"{1.0 / pace:.4g}"
    partial = target.with_name(f"{target.stem}.partial.mp4")
    command = ["ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
               "-r", rate, "-i", "-", "-pix_fmt", "yuv420p", str(partial)]  # fmt: skip
    frames = b"".join(np.asarray(picture.crop((0, 0, width, height))).tobytes() for picture in pictures)
    process = subprocess.run(command, input=frames, capture_output=True, check=False)  # noqa: S603 a fixed command
    if process.returncode:
        partial.unlink(missing_ok=True)
        raise CaseError(f"ffmpeg could not write {target}: {process.stderr.decode(errors='replace')[:300]}", where="-o")
    os.replace(partial, target)
    return target
