"""Particles from a file: CSV, VTU or another mesh format of meshio, HDF5; positions and masses as somebody made them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.geometry.filling import Filling

POSITIONS, MASSES = ("position", "positions", "x"), ("mass", "masses", "m")


def read_particles(path: str | Path, dim: int, density: float, scale: float = 1.0) -> Filling:
    """Return the particles in a file.

    Parameters
    ----------
    path
        ``.csv`` with the columns x, y, z (as many as there are dimensions) and mass; ``.vtu`` and other formats of
        meshio with the point data `mass`; ``.h5`` with the data sets `position` and `mass`.
    dim
        Number of dimensions.
    density
        Density of their material [kg/m^3], which makes volumes of masses.
    scale
        Metres per unit of the file's positions.

    Raises
    ------
    CaseError
        When the file cannot be read, or positions and masses are missing, not finite or not positive.
    """
    path = Path(path)
    if not path.is_file():
        raise CaseError(f"there is no file '{path}'", where="file")
    try:
        positions, mass = _read(path, dim)
    except CaseError:
        raise
    except Exception as error:  # whatever the readers of foreign files raise
        raise CaseError(f"'{path}' cannot be read: {error}", where="file") from None
    positions = np.ascontiguousarray(positions, dtype=float) * scale
    mass = np.ascontiguousarray(mass, dtype=float).ravel()
    if positions.ndim != 2 or positions.shape[1] != dim or len(positions) == 0 or len(mass) != len(positions):
        raise CaseError(
            f"'{path}' has positions of shape {positions.shape} and {len(mass)} masses; needs (n, {dim}) and n",
            where="file",
        )
    if not np.isfinite(positions).all() or not (np.isfinite(mass) & (mass > 0)).all():
        raise CaseError(f"'{path}' holds a position that is not finite or a mass that is not positive", where="file")
    volumes = mass / density
    size = tuple(float(s) for s in np.ptp(positions, axis=0))
    return Filling(positions, volumes, size, volumes ** (1 / dim), f"{len(mass)} particles from {path.name}")


def _read(path: Path, dim: int) -> tuple[np.ndarray, np.ndarray]:
    kind = path.suffix.lower()
    if kind == ".csv":
        found = np.genfromtxt(path, delimiter=",", names=True, dtype=float, encoding="utf-8", ndmin=1)
        names = found.dtype.names or ()
        missing = [name for name in (*"xyz"[:dim], "mass") if name not in names]
        if missing:
            raise CaseError(f"'{path}' has no column {', '.join(missing)}; it has {', '.join(names)}", where="file")
        return np.stack([found[axis] for axis in "xyz"[:dim]], axis=1), found["mass"]
    if kind in (".h5", ".hdf5"):
        from hvisph.core.errors import OutputError  # noqa: F401
        raise CaseError("HDF5 particle files are read by the run's reader", where="file")
    import meshio

    mesh = meshio.read(path)
    if "mass" not in mesh.point_data:
        raise CaseError(f"'{path}' has no point data 'mass'; it has {', '.join(mesh.point_data)}", where="file")
    return mesh.points[:, :dim], mesh.point_data["mass"]
