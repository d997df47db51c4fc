"""Initial velocities of a body's particles: uniform velocity and velocity fields."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hvisph.core.errors import CaseError

if TYPE_CHECKING:
    from hvisph.case.bodies import Body, LinearField, RadialField, SpinField, TableField, UniformField

# A field may differ by so much of its largest velocity from its mirror image.
UNLIKE = 1e-6


def initial_velocity(model: Body, positions: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return the initial velocity of particles (n, dim) [m/s]; fields are centred at `middle` [m] by default."""
    velocity = np.tile(np.asarray(model.velocity, dtype=float), (len(positions), 1))
    for number, field in enumerate(model.initial_velocity):
        centre = getattr(field, "centre", None)
        about = middle if centre is None else np.asarray(centre)
        try:
            velocity += _FIELDS[field.type](field, positions, positions - about)
        except CaseError as error:
            raise CaseError(error.message, where=f"initial_velocity.{number}.{error.where}") from error
    return velocity


def refuse_unlike_halves(model: Body, positions: np.ndarray, middle: np.ndarray, axis: int, at: float) -> None:
    """Raise an error for a field that is not symmetric about the plane `at` [m] across `axis`.

    Raises `CaseError` with the field's number; tables, which may hold the kept half alone, are not tried.
    """
    turned = positions.copy()
    turned[:, axis] = 2.0 * at - turned[:, axis]
    for number, field in enumerate(model.initial_velocity):
        if field.type in ("uniform", "table"):
            continue
        alone = model.model_copy(update={"velocity": (0.0,) * positions.shape[1], "initial_velocity": (field,)})
        here, there = initial_velocity(alone, positions, middle), initial_velocity(alone, turned, middle)
        there[:, axis] *= -1.0
        if np.abs(here - there).max() > UNLIKE * np.abs(here).max():
            plane = f"{'xyz'[axis]} = {at:g}"
            raise CaseError(
                f"the symmetry plane {plane} cuts this body, and a {field.type} of one half is no mirror image of that "
                "of the other; leave out the plane, or give a field that is symmetric about it",
                where=f"initial_velocity.{number}",
            )


def _uniform(field: UniformField, positions: np.ndarray, offset: np.ndarray) -> np.ndarray:
    return np.tile(np.asarray(field.velocity, dtype=float), (len(positions), 1))


def _spin(field: SpinField, positions: np.ndarray, offset: np.ndarray) -> np.ndarray:
    if offset.shape[1] == 2:
        return field.rate * np.stack([-offset[:, 1], offset[:, 0]], axis=1)
    return np.cross(field.rate * _unit(field.axis), offset)


def _radial(field: RadialField, positions: np.ndarray, offset: np.ndarray) -> np.ndarray:
    if field.axis is not None and offset.shape[1] == 3:
        along = _unit(field.axis)
        offset = offset - np.outer(offset @ along, along)
    r = np.sqrt((offset**2).sum(axis=1))
    away = np.maximum(r, 1e-12 * field.radius)
    speed = np.where(r > 1e-12 * field.radius, field.speed * (away / field.radius) ** field.power, 0.0)
    return offset * (speed / away)[:, None]


def _linear(field: LinearField, positions: np.ndarray, offset: np.ndarray) -> np.ndarray:
    return offset @ np.asarray(field.gradient).T


def _table(field: TableField, positions: np.ndarray, offset: np.ndarray) -> np.ndarray:
    from hvisph.geometry.particle_file import read_columns

    dim = positions.shape[1]
    columns = read_columns(field.file, (*"xyz"[:dim], *"uvw"[:dim]))
    points, values = np.stack(columns[:dim], axis=1), np.stack(columns[dim:], axis=1)
    if dim == 1:
        order = np.argsort(points[:, 0])
        return np.interp(positions[:, 0], points[order, 0], values[order, 0])[:, None]
    from hvisph.geometry.particle_file import interpolate

    return interpolate(points, values, positions)


_FIELDS: dict[str, Callable[..., np.ndarray]] = {
    "uniform": _uniform,
    "spin": _spin,
    "radial": _radial,
    "linear": _linear,
    "table": _table,
}


def _unit(direction: object) -> np.ndarray:
    vector = np.asarray(direction, dtype=float)
    length = float(np.sqrt(vector @ vector))
    if not length > 0:
        raise CaseError("the axis of a velocity field must not be all zero", where="axis")
    return vector / length
