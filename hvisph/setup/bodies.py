"""Particle positions of the bodies of a case: shapes, lattices and placement."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from hvisph.case.bodies import Body
from hvisph.case.case import Case
from hvisph.core.errors import CaseError, locate
from hvisph.geometry.cutting_planes import Edge, Mirror, Section, crosses, cut, cut_open, fill_section
from hvisph.geometry.filling import fill, refuse_sparse
from hvisph.geometry.lattices import Filling, Grading, fill_graded
from hvisph.geometry.overlap import Standing, overlaps
from hvisph.geometry.particle_file import read_particles
from hvisph.geometry.placement import ball_volume, needed_turn, owner_of, place_spheres, rotate, rotation_matrix, row
from hvisph.geometry.shapes import Box, Cylinder, Disc, Interval, Placed, Shape, Sphere

from .materials import material_of, start_of
from .shapes import initial_velocity, refuse_unlike_halves, shape_of
from .start import carried_fields, origin_of

# Shapes that touch others on the shot line at their outermost particles, unless they are turned.
FLAT_CONTACT_SHAPES = (Interval, Disc, Sphere, Box, Cylinder)
ROUNDING = 1e-6  # [dx]; largest round-off of positions: strains between neighbours are resolved to this size


@dataclass(frozen=True)
class PlacedBody:
    """Body at its initial position.

    `filling` are the particles of the whole body about its origin, rotated; `positions` (n, dim) [m], `volumes` (n,)
    [m^dim] and `spacing` (n,) [m] those kept by symmetry planes. `middle` is the centre of mass of the whole body [m],
    `surface` None for particles from a file. `carried` are the fields of a body
    that starts from another run, by name.
    """

    name: str
    model: Body
    filling: Filling
    positions: np.ndarray
    volumes: np.ndarray
    spacing: np.ndarray
    middle: np.ndarray
    surface: Placed | None = None
    carried: dict[str, np.ndarray] = field(default_factory=dict)
    included: int = 0  # last particles, which are of the material of its inclusions

    @property
    def parts(self) -> "tuple[PlacedBody, ...]":
        """The body, or its matrix and its inclusions as bodies of one material each."""
        inclusions = self.model.inclusions
        if inclusions is None or not self.included:
            return (self,)
        first = len(self.positions) - self.included
        inclusion_model = self.model.model_copy(update={"material": inclusions.material})

        def part(model: Body, rows: slice) -> "PlacedBody":
            arrays = {name: getattr(self, name)[rows] for name in ("positions", "volumes", "spacing")}
            return replace(self, model=model, included=0, **arrays)

        return part(self.model, slice(None, first)), part(inclusion_model, slice(first, None))

    @property
    def breadth(self) -> np.ndarray:
        """Side of the square or cube of each particle's initial volume or section (n,) [m]."""
        if self.carried:
            return self.spacing
        if isinstance(getattr(self.surface, "shape", None), Section):
            return np.sqrt(self.volumes / (2.0 * np.pi * self.positions[:, 1]))
        return np.asarray(self.volumes ** (1.0 / self.positions.shape[1]))

    @property
    def velocity(self) -> np.ndarray:
        """Initial velocity of each particle, (n, dim) [m/s]."""
        if self.carried:
            return self.carried["velocity"]
        with locate(f"bodies.{self.name}"):
            return initial_velocity(self.model, self.positions, self.middle)

    @property
    def mean_velocity(self) -> np.ndarray:
        """Initial velocity of the centre of mass, (dim,) [m/s]."""
        return np.asarray(self.volumes @ self.velocity / self.volumes.sum())

    @property
    def requested_volume(self) -> float:
        """Volume of the shape, or of its part kept by symmetry planes [m^dim]."""
        lattice = float(self.filling.volumes.sum())
        shape = lattice if self.surface is None else _solid(self.surface.shape).volume
        return shape * float(self.volumes.sum()) / lattice


def open_edges(case: Case) -> list[Edge]:
    """Return the open edges of a case."""
    return [Edge("xyz".index(edge.axis), edge.at, edge.sign) for edge in case.edges]


def layer_depth(case: Case) -> float:
    """Return the depth of the ambient layer beyond an edge in spacings: the kernel support, 0 with viscous edges."""
    model = case.formulation
    return model.support_over_h * model.h_over_dx if model.type == "riemann" else 0.0


def placed_bodies(case: Case) -> list[PlacedBody]:
    """Fill all bodies of a case with particles and place them.

    Raises `CaseError` where a shape cannot be filled, bodies overlap, a symmetry plane leaves nothing of a body or
    passes through one that is not symmetric about it.
    """
    if case.start is not None:
        return _with_carried(case)
    dim = case.dim
    mirrors = [Mirror("xyz".index(p.axis), p.at, 1.0 if p.keep == "above" else -1.0) for p in case.symmetry]
    edges = open_edges(case)
    fillings, shapes, faced = [], [], []
    for name, model in case.bodies.items():
        turn = None
        if model.rotation is not None:
            turn = rotation_matrix(dim, model.rotation.radians, model.rotation.axis)
        try:
            if turn is not None and mirrors and model.shape.type not in ("particles", "mesh"):
                turn = needed_turn(shape_of(model.shape, dim), turn)
            shape, filling = _fill_body(case, model, turn, mirrors)
        except CaseError as error:
            raise CaseError(error.message, where=f"bodies.{name}.{error.where or 'shape'}") from error
        fillings.append(filling if turn is None else rotate(filling, turn))
        shapes.append(None if shape is None else Placed(shape, np.zeros(dim), turn))
        faced.append(turn is None and isinstance(_solid(shape), FLAT_CONTACT_SHAPES))
    models = list(case.bodies.values())
    centres = row(fillings, [m.gap for m in models], [m.position for m in models], shapes, faced)
    bodies = []
    for (name, model), filling, shape, centre in zip(case.bodies.items(), fillings, shapes, centres, strict=True):
        spacing = np.broadcast_to(np.asarray(filling.spacing, dtype=float), filling.count)
        try:
            positions, volumes, rows = cut(filling.positions + centre, filling.volumes, spacing, mirrors)
            positions, volumes, spacing = cut_open(
                positions, volumes, spacing[rows], edges, layer_depth(case), case.drawing_dimensions != dim
            )
        except CaseError as error:
            raise CaseError(error.message, where=f"bodies.{name}") from error
        if not len(positions):
            places = zip("xyz", filling.positions.T + centre[:, None], strict=False)
            reach = ", ".join(f"{axis} from {x.min():.3g} to {x.max():.3g}" for axis, x in places)
            fault = f"the symmetry planes leave no particle of this body, of {reach}; give it a `position`, or"
            raise CaseError(f"{fault} a plane its other side, `keep`", where=f"bodies.{name}")
        _refuse_distance(name, positions, float(spacing.min()), case.units)
        surface = None if shape is None else Placed(shape.shape, centre, shape.matrix)
        middle = centre + filling.volumes @ filling.positions / filling.volumes.sum()
        if case.drawing_dimensions != case.dim:
            middle[1] = 0.0
        for mirror in mirrors:
            if len(rows) < filling.count and abs(middle[mirror.axis] - mirror.at) < spacing.min():
                middle[mirror.axis] = mirror.at
                with locate(f"bodies.{name}"):
                    refuse_unlike_halves(model, positions, middle, mirror.axis, mirror.at)
        body = PlacedBody(name, model, filling, positions, volumes, spacing, middle, surface)
        bodies.append(body if model.inclusions is None else _with_inclusions(body))
    _refuse_overlaps(bodies, case.units)
    if dim == 1:
        _refuse_disorder(bodies)
    return bodies


def _with_inclusions(body: PlacedBody) -> PlacedBody:
    """Return a body whose last particles are those of its inclusions; both have the volumes of their shapes."""
    own, surface = body.model.inclusions, body.surface
    assert own is not None
    assert surface is not None
    with locate(f"bodies.{body.name}.inclusions"):
        centres, diameters = place_spheres(surface.shape, own.diameters, own.exponent, own.volume, own.seed, body.name)
    rotated = centres if surface.matrix is None else centres @ surface.matrix.T
    inside = owner_of(body.positions, rotated + surface.position, diameters) >= 0
    volumes, dim = body.volumes.copy(), body.positions.shape[1]
    exact = sum(ball_volume(d, dim) for d in diameters) / surface.shape.volume * float(volumes.sum())
    if not inside.any() or inside.all():
        fault = "the spheres leave one of both materials without particles; change their volume or diameters"
        raise CaseError(fault, where=f"bodies.{body.name}.inclusions")
    volumes[~inside] *= (volumes.sum() - exact) / volumes[~inside].sum()
    volumes[inside] *= exact / volumes[inside].sum()
    order = np.argsort(inside, kind="stable")
    note = f"{len(diameters)} inclusions of {own.material.name or 'another material'}"
    filling = replace(body.filling, note="; ".join(filter(None, (body.filling.note, note))))
    return replace(
        body,
        filling=filling,
        positions=body.positions[order],
        volumes=volumes[order],
        spacing=body.spacing[order],
        included=int(inside.sum()),
    )


def _with_carried(case: Case) -> list[PlacedBody]:
    """Return the bodies of the run that a case starts from, and those that it adds."""
    origin = origin_of(case)
    placed: dict[str, PlacedBody] = {}
    for name, fields in carried_fields(case, origin).items():
        model, x = case.bodies[name], fields["position"]
        if not len(x):
            raise CaseError("has no particle left in the run; there is nothing to start from", where=f"bodies.{name}")
        density, _ = start_of(name, model, material_of(model.material, model.internal_energy))
        volumes, spacing = fields["mass"] / density, fields["spacing"]
        note = f"of {origin.folder.name} at {origin.snapshot.time:.6g}{' s' if case.units == 'si' else ''}"
        size = tuple(float(side) for side in np.ptp(x, axis=0) + spacing.max())
        middle = fields["mass"] @ x / fields["mass"].sum()
        filling = Filling(x, volumes, size, spacing, note)
        placed[name] = PlacedBody(name, model, filling, x, volumes, spacing, middle, None, fields)
    added = {name: model for name, model in case.bodies.items() if name not in placed}
    for name, model in added.items():
        if model.position is None:
            message = "is needed for a body that is added to another run, whose bodies have moved"
            raise CaseError(message, where=f"bodies.{name}.position")
    if added:
        added_bodies = placed_bodies(case.model_copy(update={"bodies": added, "start": None}))
        for body in added_bodies:
            for existing in placed.values():
                _refuse_overlaps([body, existing], case.units)
        placed |= {body.name: body for body in added_bodies}
    bodies = [placed[name] for name in case.bodies]
    if case.dim == 1:
        _refuse_disorder(bodies)
    return bodies


def _fill_body(
    case: Case, model: Body, turn: np.ndarray | None, mirrors: Sequence[Mirror]
) -> tuple[Shape | None, Filling]:
    """Return the shape and the particles of a body about its origin."""
    dx = model.spacing(case)
    if model.shape.type == "particles":
        try:  # porous or warm, they weigh what the file says
            density, _ = start_of("", model, material_of(model.material, model.internal_energy))
        except CaseError as error:
            raise CaseError(error.message, where="temperature") from error
        return None, read_particles(model.shape.file, case.dim, density, model.shape.unit)
    exact = model.mass == "exact"
    axisymmetric = case.drawing_dimensions != case.dim
    solid = shape_of(model.shape, case.drawing_dimensions)
    shape = Section(solid) if axisymmetric else solid
    refuse_sparse(shape, dx)
    even = _split_by(shape, turn, model.position, mirrors, dx) if exact else ()
    grading = None
    if model.grading is not None:
        grading = Grading(model.grading.fine, model.grading.coarsest, model.grading.ratio, model.grading.face)
    if axisymmetric:
        return shape, fill_section(solid, model.arrangement, dx, exact=exact, even=even, grading=grading)
    if grading is not None:
        return shape, fill_graded(shape, dx, grading, even)
    return shape, fill(shape, model.arrangement, dx, exact=exact, even=even)


def _split_by(
    shape: Shape, turn: np.ndarray | None, position: Sequence[float] | None, mirrors: Sequence[Mirror], dx: float
) -> tuple[int, ...]:
    """Return the body axes across whose middle a symmetry plane lies."""
    centre = np.zeros(shape.dim) if position is None else np.asarray(position)
    low, high = Placed(shape, centre, turn).bounds()
    parts = []
    for mirror in mirrors:
        # where a body in the row stands along x is not known yet
        if (mirror.axis == 0 and position is None) or not crosses(low, high, mirror, dx):
            continue
        normal = np.eye(shape.dim)[mirror.axis] if turn is None else turn[mirror.axis]
        body_axis = int(np.abs(normal).argmax())
        if abs(normal[body_axis]) > 1 - 1e-9:
            parts.append(body_axis)
    return tuple(dict.fromkeys(parts))


def _solid(shape: object) -> Any:
    """Return the solid of a half-plane section, any other shape unchanged."""
    return shape.solid if isinstance(shape, Section) else shape


def _refuse_distance(name: str, positions: np.ndarray, spacing: float, units: str) -> None:
    """Raise an error where round-off of the positions is a noticeable part of the spacing."""
    rounding = float(np.spacing(np.abs(positions).max()))
    if rounding > ROUNDING * spacing:
        unit = " m" if units == "si" else ""
        raise CaseError(
            f"lies so far from the origin that places are resolved to {rounding:.2g}{unit} only, and its particles "
            f"are {spacing:.2g}{unit} apart; move it nearer (position, gap)",
            where=f"bodies.{name}",
        )


def _refuse_disorder(bodies: list[PlacedBody]) -> None:
    """Raise an error unless layers are ordered from left to right."""
    for before, body in pairwise(bodies):
        if body.positions.min() < before.positions.min():
            fault = f"stands left of '{before.name}', which is listed before it; list the layers from left to"
            raise CaseError(f"{fault} right, or change their positions", where=f"bodies.{body.name}.position")


def _refuse_overlaps(bodies: list[PlacedBody], units: str) -> None:
    """Raise an error where bodies overlap."""
    for overlap in overlaps([_standing(body) for body in bodies]):
        first, second = (bodies[i] for i in overlap.bodies)
        scale, unit = (1e3, " mm") if units == "si" else (1.0, "")
        place = ", ".join(f"{scale * float(c):.4g}" for c in overlap.place)
        spacing = min(first.filling.finest, second.filling.finest)
        extent = f"by {overlap.depth / spacing:.2g} spacings or more" if overlap.depth else "there is matter of both"
        fault = f"overlaps '{second.name}': {extent}, at ({place}){unit}; move one (position, gap) or shrink it"
        raise CaseError(fault, where=f"bodies.{first.name}")


def _standing(body: PlacedBody) -> Standing:
    """Return a predicate on the overlap of `body` with another."""
    return Standing(body.positions, body.breadth, (body.filling.finest, float(body.spacing.max())), body.surface)
