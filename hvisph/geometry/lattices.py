"""Lattices of particles: simple, triangular, hexagonal close packing, and concentric circles."""

import math
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.geometry.shapes import Box, Cylinder, Disc, Interval
from hvisph.geometry.shapes.shape import Shape, grid

ROUND_OFF = 1e-9  # against round-off in length / spacing: 50.1 mm / 0.1 mm must be 501 on every machine


@dataclass(frozen=True)
class Filling:
    """The particles of one body, around the origin of its shape."""

    positions: np.ndarray  # particle centres in the shape's coordinates, shape (n, dim) [m]
    volumes: np.ndarray  # volume of each particle, shape (n,) [m^dim]
    size: tuple[float, ...]  # full size along each axis that the particles stand for [m]
    # spacing of the particles, which their smoothing length follows: one for all, or shape (n,) [m]
    spacing: float | np.ndarray
    note: str = ""  # changed quantities: sizes in a nominal filling, spacing and masses in an exact one; empty if none

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.positions)

    @property
    def finest(self) -> float:
        """Least spacing [m]."""
        return float(np.min(self.spacing))


def count_across(length: float, spacing: float, noun: str = "body", even: bool = False) -> int:
    """Return the count, or count of pairs, that at `spacing` comes nearest to `length` [m]; `CaseError` if none."""
    count = math.floor(length / spacing + 0.5 + ROUND_OFF)
    if count < 1:
        raise CaseError(
            f"the {noun} of {length:g} is thinner than half a particle at spacing {spacing:g}; "
            "refine the resolution or enlarge the body",
            where="resolution",
        )
    return 2 * max(1, math.floor(length / spacing / 2 + 0.5 + ROUND_OFF)) if even else count


def make_filling(positions: np.ndarray, dx: float, size: tuple[float, ...], requested: tuple[float, ...]) -> Filling:
    """Return the `Filling` of particles of volume dx^dim, with a note on another size; `CaseError` without any."""
    if len(positions) == 0:
        raise CaseError(f"no particle at spacing {dx:g} fits into the body", where="resolution")
    differs = any(abs(got - want) > ROUND_OFF * want for got, want in zip(size, requested, strict=True))
    note = f"{_sizes(requested)} is filled as {_sizes(size)} at resolution {dx:g}" if differs else ""
    volumes = np.full(len(positions), dx ** positions.shape[1])
    return Filling(np.ascontiguousarray(positions), volumes, size, dx, note)


def centre_coordinates(count: int, spacing: float) -> np.ndarray:
    """Return `count` coordinates at `spacing` [m], symmetric about 0 to the last bit."""
    return (np.arange(count) - (count - 1) / 2) * spacing


def cover(low: float, high: float, spacing: float, even: bool = False) -> np.ndarray:
    """Return coordinates at `spacing` [m] centred between `low` and `high`, as many as come nearest to fill it."""
    return (low + high) / 2 + centre_coordinates(count_across(high - low, spacing, even=even), spacing)


def _sizes(size: tuple[float, ...]) -> str:
    return " x ".join(f"{side:.6g}" for side in size)


AT_ONCE = 2_000_000  # nodes that are looked at together
# Distance of nodes over dx [-], so that a cell has the area dx^2 (2D) or the volume dx^3 (3D).
TRIANGULAR, CLOSE_PACKED = (4 / 3) ** 0.25, 2 ** (1 / 6)


def fill_lattice(shape: Shape, dx: float, even: tuple[int, ...] = ()) -> Filling:
    """Fill `shape` with a simple lattice of spacing `dx` [m]: equidistant in 1D, square in 2D, cubic in 3D.

    Along an axis a body of size L holds n = round(L / dx) particles at (i - (n - 1) / 2) dx, so that the outer
    particles lie dx / 2 inside the faces: 2 mm at 0.1 mm are 20 layers. Round shapes keep the nodes strictly inside. A
    sphere 12 dx across holds 912 particles.

    `even`: axes along which the number of layers is even, so that none lies in the middle.
    Raises `CaseError` when the shape is thinner than half a particle.
    """
    low, high = shape.bounds()
    axes = [
        low[k] + (np.arange(count_across(high[k] - low[k], dx) + 1) + 0.5) * dx
        if k in shape.wall_axes and k not in shape.flat_axes
        else cover(low[k], high[k], dx, k in even)
        for k in range(shape.dim)
    ]
    size = tuple(len(axis) * dx for axis in axes)
    if isinstance(shape, Box | Interval):
        return make_filling(grid([centre_coordinates(len(axis), dx) for axis in axes]), dx, size, shape.extent())
    step = max(1, AT_ONCE // max(1, int(np.prod([len(axis) for axis in axes[1:]]))))
    slabs = [[axes[0][k : k + step], *axes[1:]] for k in range(0, len(axes[0]), step)]
    points = np.concatenate([grid(slab)[shape.contains_grid(slab)] for slab in slabs])
    return make_filling(points, dx, size, shape.extent())


def fill_hexagonal(shape: Shape, dx: float) -> Filling:
    """Fill the shape with a triangular lattice of cell area `dx`^2 [m^2]: six neighbours at the distance a.

    A node's cell has the area a^2 sqrt(3) / 2; a = dx (4/3)^(1/4) = 1.0746 dx makes it dx^2. Columns stand along y, a
    sqrt(3) / 2 apart in x, so that the face towards the other body is flat. Discs have a node at the centre. In boxes
    columns of n and n + 1 nodes alternate, each centred on the axis, with n chosen so that their mean comes nearest to
    the height. Raises `CaseError` when the shape is thinner than half a column.
    """
    a = TRIANGULAR * dx
    column_spacing = a * math.sqrt(3) / 2
    if not isinstance(shape, Box):
        low, high = shape.bounds()
        half_width, half_height = ((high - low) / 2).tolist()
        half = count_across(half_width, column_spacing, f"{shape.kind}'s half width") + 1
        nodes = 2 * (count_across(max(half_height, a), a) + 1) + 1
        columns = [_column(k * column_spacing, centre_coordinates(nodes + k % 2, a)) for k in range(-half, half + 1)]
        points = np.concatenate(columns) + (low + high) / 2
        return make_filling(points[shape.contains(points)], dx, shape.extent(), shape.extent())
    width, height = shape.extent()
    count = count_across(width, column_spacing)
    count_across(height, a)
    short = max(1, math.floor(height / a))
    places = enumerate(centre_coordinates(count, column_spacing))
    columns = [_column(x, centre_coordinates(short + (k + 1) % 2, a)) for k, x in places]
    mean = short + sum((k + 1) % 2 for k in range(count)) / count
    return make_filling(np.concatenate(columns), dx, (count * column_spacing, mean * a), shape.extent())


def _column(x: float, y: np.ndarray) -> np.ndarray:
    return np.stack([np.full(len(y), x), y], axis=1)


def fill_hcp(shape: Shape, dx: float) -> Filling:
    """Fill the shape with hexagonal close packing of cell volume `dx`^3 [m^3]: twelve neighbours at the distance a.

    A node's cell has the volume a^3 / sqrt(2); a = 2^(1/6) dx = 1.1225 dx makes it dx^3. Triangular layers lie across x
    (across the axis of a cylinder), a sqrt(2/3) apart, so that the face towards the other body is flat; every second
    layer is shifted into the hollows of the first. Spheres have a node at the centre. Raises `CaseError` when the shape
    is thinner than half a layer or row.
    """
    a = CLOSE_PACKED * dx
    steps = (a * math.sqrt(2 / 3), a, a * math.sqrt(3) / 2)  # layer, node in a row, row
    if isinstance(shape, Cylinder):
        layers = count_across(shape.length, steps[0])
        half = [count_across(shape.diameter / 2, step, "cylinder's radius") + 1 for step in steps[1:]]
        points = _nodes([np.arange(layers), *(np.arange(-h, h + 1) for h in half)]) * steps
        points[:, 0] -= (layers - 1) / 2 * steps[0]
        points = np.roll(points, shape.axis_column, axis=1)
        size = tuple(layers * steps[0] if axis == shape.axis_column else shape.diameter for axis in range(3))
        return make_filling(points[shape.contains(points)], dx, size, shape.extent())
    if not isinstance(shape, Box):
        low, high = shape.bounds()
        sides = zip((high - low) / 2, steps, strict=True)
        half = [count_across(max(float(side), step), step, f"{shape.kind}'s half width") + 1 for side, step in sides]
        points = _nodes([np.arange(-h, h + 1) for h in half]) * steps + (low + high) / 2
        return make_filling(points[shape.contains(points)], dx, shape.extent(), shape.extent())
    counts = [count_across(side, step) for side, step in zip(shape.extent(), steps, strict=True)]
    points = _nodes([np.arange(count) for count in counts]) * steps
    points -= (points.min(axis=0) + points.max(axis=0)) / 2
    return make_filling(points, dx, tuple(n * step for n, step in zip(counts, steps, strict=True)), shape.extent())


def _nodes(indices: list[np.ndarray]) -> np.ndarray:
    """Return the nodes of `indices` (layer, node, row) in units of the three steps: (n, 3)."""
    layer, node, row = (index.ravel() for index in np.meshgrid(*indices, indexing="ij"))
    odd_layer = layer % 2
    return np.stack([layer, node + ((row + layer) % 2) / 2, row + odd_layer / 3], axis=1)


def fill_rings(shape: Disc, dx: float) -> Filling:
    """Fill the disc with concentric circles of particles a distance `dx` [m] apart.

    The first particle of each circle is at angle 0. A disc 100 dx across holds 8012 particles, the count of Farahani et
    al. 2009. The last circle lies on the disc's circumference, so the particles stand for a little more area than the
    disc has (1 + dx / R times). Raises `CaseError` when the radius is shorter than half a particle.
    """
    last = count_across(shape.diameter / 2, dx, "disc's radius")
    rings = [ring(k * dx, round(2 * math.pi * k)) for k in range(1, last + 1)]
    points = np.concatenate([np.zeros((1, 2)), *rings])
    return make_filling(points, dx, (2 * last * dx,) * 2, shape.extent())


def ring(radius: float, count: int) -> np.ndarray:
    """Return `count` points on a circle (count, 2) [m] from angle 0; the lower half mirrors the upper bit for bit."""
    half = count // 2
    angles = 2 * math.pi / count * np.arange(half + 1)
    upper = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    upper[0, 1] = 0.0
    if count % 2 == 0:
        upper[half] = (-radius, 0.0)
    lower = upper[1 : count - half][::-1] * (1.0, -1.0)
    return np.concatenate([upper, lower])


def fill_lattice_two_rings(shape: Disc, dx: float) -> Filling:
    """Fill the disc with a square lattice of spacing `dx` [m] inside two concentric circles of particles.

    With m = round(R / dx), the nodes (i, j) dx with i^2 + j^2 < (m - 2)^2, then circles of radius (m - 1) dx and m dx.
    The inner circle's count is 2 pi (m - 1) rounded down, the outer's 2 pi m rounded: the reading with which a disc 100
    dx across holds 7209 + 307 + 314 = 7830 particles, the count and the remark on rounding of Young et al. 2021, sec.
    3.2 (after Mehra & Chaturvedi 2006). Raises `CaseError` when the radius is shorter than 3 dx: no lattice would be
    left inside the rings.
    """
    last = count_across(shape.diameter / 2, dx, "disc's radius")
    if last < 3:
        raise CaseError(
            f"lattice_two_rings needs a radius of at least 3 particle spacings, not {last}; "
            "refine the resolution or take the arrangement square",
            where="arrangement",
        )
    # whole numbers: which nodes are strictly inside must not hang on round-off
    nodes = np.arange(-(last - 3), last - 2)
    i, j = (index.ravel() for index in np.meshgrid(nodes, nodes, indexing="ij"))
    inside = i * i + j * j < (last - 2) ** 2
    lattice = np.stack([i[inside], j[inside]], axis=1) * dx
    inner = ring((last - 1) * dx, math.floor(2 * math.pi * (last - 1)))
    outer = ring(last * dx, round(2 * math.pi * last))
    return make_filling(np.concatenate([lattice, inner, outer]), dx, (2 * last * dx,) * 2, shape.extent())


STEEPEST = 1.1  # thickness of a layer over that of the layer before it


@dataclass(frozen=True)
class Grading:
    """Growth of the spacing."""

    # full width of the fine part along each axis [m], about the box's middle or the axis of revolution; None along an
    # axis that is not graded
    fine: tuple[float | None, ...]
    coarsest: float  # largest spacing [m]
    ratio: float = STEEPEST  # thickness of a layer over that of the layer before it, above 1 and at most 1.1
    # where along x the fine part lies: in the `middle`, at the `front` (the face at lower x) or at the `rear`
    face: str = "middle"


def fill_graded(shape: Shape, dx: float, grading: Grading, even: tuple[int, ...] = ()) -> Filling:
    """Fill a box with layers that grow away from its fine part; no layer lies in the middle of the axes `even`.

    `shape` is an `Interval`, a `Box` or the `Section` of a cylinder, a tube or a ring of a box, whose y is the radius
    and whose volumes are areas.
    """
    low, high = shape.bounds()
    edges = []
    for axis, fine in enumerate(grading.fine):
        length = float(high[axis] - low[axis])
        if axis in shape.radial_axes:
            share = None if fine is None else max(fine / 2 - float(low[axis]), dx)
            edges.append(low[axis] + _from_face(length, share, dx, grading))
        elif axis == 0 and grading.face == "front":
            edges.append(low[axis] + _from_face(length, fine, dx, grading))
        elif axis == 0 and grading.face == "rear":
            edges.append(high[axis] - _from_face(length, fine, dx, grading)[::-1])
        else:
            edges.append((low[axis] + high[axis]) / 2 + _from_middle(length, fine, dx, grading, axis in even))
    widths = grid([np.diff(e) for e in edges])
    positions = grid([(e[1:] + e[:-1]) / 2 for e in edges])
    longest = widths.max(axis=1)
    layers = list(map(np.diff, edges))
    steepest = max(float(np.max(np.maximum(w[1:] / w[:-1], w[:-1] / w[1:]), initial=1.0)) for w in layers)
    note = (
        f"graded from {min(float(w.min()) for w in map(np.diff, edges)):.4g} to {float(longest.max()):.4g}, "
        f"by {steepest:.3g} a layer at most"
    )
    return Filling(positions, widths.prod(axis=1), shape.extent(), longest, note)


def _from_face(length: float, fine: float | None, dx: float, grading: Grading) -> np.ndarray:
    """Return the edges of the layers, fine from 0 on."""
    count = count_across(min(fine or dx, length), dx)
    grown = _layer_thicknesses(length - count * dx, dx, grading) if fine is not None else None
    if grown is None:
        return np.linspace(0.0, length, count_across(length, dx) + 1)
    edges = np.concatenate([np.arange(count + 1) * dx, count * dx + np.cumsum(grown)])
    edges[-1] = length
    return edges


def _from_middle(length: float, fine: float | None, dx: float, grading: Grading, even: bool) -> np.ndarray:
    """Return the edges of the layers, symmetric about 0."""
    middle = count_across(min(fine or dx, length), dx, even=even)
    half = middle * dx / 2
    grown = _layer_thicknesses(length / 2 - half, dx, grading) if fine is not None else None
    if grown is None:
        return np.linspace(-0.5, 0.5, count_across(length, dx, even=even) + 1) * length
    outer = half + np.cumsum(grown)
    edges = np.concatenate([-outer[::-1], np.linspace(-half, half, middle + 1), outer])
    edges[0], edges[-1] = -length / 2, length / 2
    return edges


def _layer_thicknesses(depth: float, dx: float, grading: Grading) -> np.ndarray | None:
    """Return as few graded layers as fill `depth` [m]; None where as many of `dx` are thicker than that."""

    def layers(count: int, ratio: float) -> np.ndarray:
        return np.asarray(np.minimum(dx * ratio ** np.arange(1, count + 1), grading.coarsest))

    count = 1
    while layers(count, grading.ratio).sum() < depth * (1 - ROUND_OFF):
        count += 1
    if count * dx > depth:
        return None
    low, high = 1.0, grading.ratio
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if layers(count, middle).sum() < depth else (low, middle)
    return layers(count, high)
