"""Pictures of a case before it runs: bodies with names, sizes and velocities, planes, clamps, gauges, first contact."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph.core.measure_catalogue import axis_unit

from .camera import revolve, rotate_view
from .style import DISC, body_colour, new_figure, store

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_SHOWN = 60_000  # particles of a view; more would not be labels apart
UNDER = 34  # [points] from the axes to the names under them
SEEN_FROM = (-35.0, -22.0)  # yaw and pitch of a view [degrees]


@dataclass(frozen=True)
class DrawnBody:
    """A body of a set-up."""

    # name, and label with material and size
    name: str
    label: str
    # particles (n, dim) and how wide each is drawn (n,) [m]
    positions: np.ndarray
    spacing: np.ndarray
    velocity: np.ndarray  # mean velocity (dim,) [m/s]
    held: np.ndarray  # which particles are clamped (n,)


@dataclass(frozen=True)
class Setup:
    """Content of a picture of a set-up."""

    title: str  # title of the case
    bodies: Sequence[DrawnBody]  # its bodies
    planes: Sequence[tuple[int, float]] = ()  # symmetry planes: axis and coordinate [m]
    gauges: Mapping[str, Sequence[float]] = field(default_factory=dict)  # places of gauges by name [m]
    notes: Sequence[str] = ()  # lines below the picture
    si: bool = True  # whether lengths are in metres
    axisymmetric: bool = False  # whether particles are axisymmetric about x: the bodies are solids of revolution
    edges: Sequence[tuple[int, float]] = ()  # open edges: axis and coordinate [m]
    gravity: Sequence[float] = ()  # acceleration of a uniform field [m/s^2]
    moving: Mapping[tuple[int, float], float] = field(default_factory=dict)  # planes that move, and their direction

    @property
    def solid(self) -> bool:
        """Whether a view shows more than a section."""
        return self.dim == 3 or self.axisymmetric

    @property
    def dim(self) -> int:
        """Number of dimensions."""
        return self.bodies[0].positions.shape[1]

    @cached_property
    def unit(self) -> tuple[str, float]:
        """Unit of lengths as an axis shows it, and the factor from the bodies' own."""
        if not self.si:
            return "", 1.0
        unit, factor = axis_unit("mm", [abs(body.positions).max() for body in self.bodies if len(body.positions)])
        return f" [{unit}]", factor

    @property
    def factor(self) -> float:
        """From lengths to the unit of the axes."""
        return self.unit[1]


def setup_picture(setup: Setup, path: str | os.PathLike[str]) -> Path:
    """Draw a set-up and store it: of solids a section along the shot line and a view, else the particles."""
    return store(setup_figure(setup), path)


def setup_figure(setup: Setup) -> Figure:
    """Return the figure of a set-up."""
    figure = new_figure((13.0 if setup.solid else 9.0, 7.0), 130)
    panels = figure.subplots(1, 2) if setup.solid else [figure.add_subplot()]
    _section(panels[0], setup)
    if setup.solid:
        _view(panels[1], setup)
    figure.suptitle(setup.title, fontsize=11)
    if setup.notes:
        figure.supxlabel("\n".join(setup.notes), fontsize=8)
    return figure


def _section(axes: Axes, setup: Setup) -> None:
    """Draw the plane through the shot line: x and y, or in 1D x alone; of axisymmetric particles both halves."""
    from matplotlib.transforms import ScaledTranslation

    unit = setup.factor
    everything = np.concatenate([body.positions for body in setup.bodies]) * unit
    first: Any = setup.bodies[0].positions  # the shot line: its middle, moved onto planes of symmetry
    middle = (first.min(axis=0) + first.max(axis=0)) / 2
    for axis, at in setup.planes:
        middle[axis] = at
    corners = []
    for number, body in enumerate(setup.bodies):
        places, spacing, clamped = body.positions, body.spacing, body.held
        if setup.axisymmetric:
            places = np.concatenate([places, places * (1.0, -1.0)])
            spacing, clamped = np.tile(spacing, 2), np.tile(clamped, 2)
        in_section = np.ones(len(places), bool)
        if setup.dim == 3:
            # the layer of particles nearest to the shot line
            distance = np.abs(body.positions[:, 2] - middle[2])
            in_section = distance < max(body.spacing.max(), distance.min() + 0.51 * body.spacing.max())
        x = places[in_section, :2] * unit
        if setup.dim == 1:
            x = np.column_stack([x, np.zeros(len(x))])
        size = DISC * spacing[in_section] * unit
        colour = body_colour(number)
        _discs(axes, x, size, ["#111111" if fixed else colour for fixed in clamped[in_section]], lw=0.0)
        if len(x):
            corners += [x.min(axis=0), x.max(axis=0)]
        axes.plot([], [], "o", color=colour, label=body.label)
    if any(body.held.any() for body in setup.bodies):
        axes.plot([], [], "o", color="#111111", label="clamped")
    low, high = np.min(np.array(corners), axis=0), np.max(np.array(corners), axis=0)
    span = float((high - low).max())
    _velocities(axes, setup, span)
    for planes, colour, dashes, name in (
        (setup.planes, "#c0392b", "-.", "symmetry"),
        (setup.edges, "#2471a3", "--", "open edge"),
    ):
        for axis, at in planes:
            if axis < 2:
                (axes.axvline if axis == 0 else axes.axhline)(at * unit, color=colour, ls=dashes, lw=1.2)
        if planes:
            positions = ", ".join(f"{'xyz'[axis]} = {at * unit:g}" for axis, at in planes)
            axes.plot([], [], dashes, color=colour, label=f"{name}: {positions}")
    _forces(axes, setup, low, high)
    if setup.axisymmetric:
        axes.axhline(0.0, color="#666666", ls=(0, (12, 3, 2, 3)), lw=0.8, label="axis")
    for name, place in setup.gauges.items():
        mark = [*(np.asarray(place) * unit), 0.0]
        axes.plot(mark[0], mark[1], "x", color="#111111", ms=6)
        axes.annotate(name, (mark[0], mark[1]), xytext=(4, 4), textcoords="offset points", fontsize=8)
    margin = 0.08 * span
    ends = {f"{x}lim": (low[k] - margin, high[k] + margin) for k, x in enumerate("xy")}
    y_label = "" if setup.dim == 1 else f"{'r' if setup.axisymmetric else 'y'}{setup.unit[0]}"
    axes.set(**ends, aspect="equal", xlabel=f"x{setup.unit[0]}", ylabel=y_label)
    count_words = f"{len(everything)} {'axisymmetric particles' if setup.axisymmetric else 'particles'}"
    axes.set_title(f"section, {count_words} in all" if setup.solid else count_words, fontsize=9)
    below = axes.transAxes + ScaledTranslation(0.0, -UNDER / 72, axes.figure.dpi_scale_trans)  # a bar's picture is flat
    axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, 0.0), bbox_transform=below, ncols=2, frameon=False)


def _forces(axes: Axes, setup: Setup, low: np.ndarray, high: np.ndarray) -> None:
    """Draw arrows of gravity, beside the bodies, and of the planes that move, between the corners of the bodies."""
    arrow, middle, span = {"arrowstyle": "-|>", "lw": 1.6}, 0.5 * (low + high), float((high - low).max())
    pull = np.append(np.asarray(setup.gravity, float), 0.0)[:2]
    size = float(np.linalg.norm(pull))
    if size > 0.0:
        start = np.array([high[0], high[1]]) - 0.05 * span
        end = start + 0.12 * span * pull / size
        axes.annotate("", tuple(end), tuple(start), arrowprops=arrow | {"color": "#7d3c98"})
        axes.plot([], [], "-", color="#7d3c98", label=f"gravity: {size:.4g}{' m/s^2' if setup.si else ''}")
    for (axis, at), direction in setup.moving.items():
        if axis < 2 and direction:
            start = middle.copy()
            start[axis] = at * setup.factor
            end = start.copy()
            end[axis] += 0.1 * span * np.sign(direction)
            axes.annotate("", tuple(end), tuple(start), arrowprops=arrow | {"color": "#c0392b"})


def _velocities(axes: Axes, setup: Setup, span: float) -> None:
    """Draw an arrow for every body that moves, the fastest a sixth of the picture long."""
    speeds = [float(np.sqrt((body.velocity**2).sum())) for body in setup.bodies]
    if not max(speeds) > 0:
        return
    labels: list[tuple[str, np.ndarray]] = []
    for body, speed in zip(setup.bodies, speeds, strict=True):
        if speed == 0:
            continue
        start = np.append(body.positions.mean(axis=0) * setup.factor, 0.0)[:2]
        if setup.axisymmetric:
            start[1] = 0.0
        end = start + np.append(body.velocity, 0.0)[:2] / max(speeds) * span / 6
        tail, head = (float(start[0]), float(start[1])), (float(end[0]), float(end[1]))
        axes.annotate("", head, tail, arrowprops={"arrowstyle": "->", "lw": 2.0, "color": "#111111"})
        box = {"fc": "white", "ec": "none", "alpha": 0.7, "pad": 1}
        text = (f"{speed:.4g} m/s" if speed < 1e4 else f"{speed * 1e-3:.4g} km/s") if setup.si else f"{speed:.4g}"
        if any(text == label and np.linalg.norm(end - place) < span / 12 for label, place in labels):
            continue  # a core and its jacket
        labels.append((text, end))
        axes.annotate(text, head, xytext=(3, 3), textcoords="offset points", fontsize=8, bbox=box)


def _view(axes: Axes, setup: Setup) -> None:
    """Draw all particles from ahead and above, far ones first, lighter with depth; three quarters of a revolution."""
    from matplotlib.colors import to_rgb

    bodies = [(body.positions, body.spacing) for body in setup.bodies]
    if setup.axisymmetric:
        revolved = [(revolve(x, float(spacing.mean()), 270.0), spacing) for x, spacing in bodies]
        # the open quarter towards the eye, which is where z is small
        bodies = [(places * (1.0, 1.0, -1.0), spacing[ring]) for (places, ring), spacing in revolved]
    positions = np.concatenate([places for places, _ in bodies]) * setup.factor
    owner = np.repeat(np.arange(len(bodies)), [len(places) for places, _ in bodies])
    spacing = np.concatenate([s for _, s in bodies]) * setup.factor
    # of too many any, larger by as much: every second or third around the axis would be a stripe
    sample = np.sort(np.random.default_rng(0).permutation(len(positions))[:MOST_SHOWN])
    spacing = spacing * np.sqrt(len(positions) / len(sample))
    right, up, depth = rotate_view(positions[sample], *SEEN_FROM).T
    order = np.argsort(-depth)
    colours = np.array([to_rgb(body_colour(k)) for k in owner[sample]])
    share = ((depth - depth.min()) / max(float(np.ptp(depth)), 1e-30))[:, None]
    colours = colours + (1 - colours) * 0.55 * share
    places, size = np.column_stack([right, up])[order], DISC * spacing[sample][order]
    _discs(axes, places, size, colours[order], lw=0.15, edgecolors="#00000055")
    margin = 0.04 * max(float(np.ptp(right)), float(np.ptp(up)))
    ends = {f"{x}lim": (values.min() - margin, values.max() + margin) for x, values in (("x", right), ("y", up))}
    axes.set(**ends, aspect="equal")
    axes.set_axis_off()
    axes.set_title("view", fontsize=9)


def _discs(axes: Axes, places: np.ndarray, size: np.ndarray, colours: Any, **style: Any) -> None:
    """Draw discs at `places` (n, 2) of diameters `size` (n,), in the unit of the axes."""
    from matplotlib.collections import EllipseCollection

    options = {"units": "xy", "transOffset": axes.transData, "offsets": places, "facecolors": colours}
    axes.add_collection(EllipseCollection(size, size, 0 * size, **options, **style))
