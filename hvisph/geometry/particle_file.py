"""Particle files: CSV, VTU or another mesh format of meshio, HDF5."""

from pathlib import Path

import h5py
import numpy as np
import scipy

from hvisph.core.errors import CaseError
from hvisph.geometry.lattices import Filling

# Of a particle's breadth: closer ones stand at one place. And how far distance and breadth may be apart: random places
# have half, gaps a multiple of a lattice's 1.
ONE_PLACE, MISFIT = 1e-3, 4.0


def read_particles(path: str | Path, dim: int, density: float, scale: float = 1.0) -> Filling:
    """Return the particles of a CSV file (x, y, z, mass), HDF5 (`position`, `mass`) or a format of meshio (`mass`).

    Volumes follow from the `density` [kg/m^3]; `scale` is metres per unit of the positions. Raises `CaseError` when the
    file cannot be read, or positions and masses are missing, not finite or not positive.
    """
    path = Path(path)
    if not path.is_file():
        raise CaseError(f"there is no file '{path}'", where="shape.file")
    try:
        positions, mass = _read(path, dim)
    except CaseError as error:
        raise CaseError(error.message, where="shape.file") from error
    except Exception as error:  # whatever the readers of foreign files raise
        raise CaseError(f"'{path}' cannot be read: {error}", where="shape.file") from None
    positions = np.ascontiguousarray(positions, dtype=float) * scale
    mass = np.ascontiguousarray(mass, dtype=float).ravel()
    if positions.ndim != 2 or positions.shape[1] != dim or len(positions) == 0 or len(mass) != len(positions):
        raise CaseError(
            f"'{path}' has positions of shape {positions.shape} and {len(mass)} masses; needs (n, {dim}) and n",
            where="shape.file",
        )
    if not np.isfinite(positions).all() or not (np.isfinite(mass) & (mass > 0)).all():
        raise CaseError(f"'{path}' holds a position that is not finite or a mass not above zero", where="shape.file")
    volumes = mass / density
    _refuse_misfit(path.name, positions, volumes ** (1 / dim))
    size = tuple(float(s) for s in np.ptp(positions, axis=0))
    return Filling(positions, volumes, size, volumes ** (1 / dim), f"{len(mass)} particles from {path.name}")


def _refuse_misfit(name: str, positions: np.ndarray, breadth: np.ndarray) -> None:
    """Refuse particles at one place, and distances that are not those of particles of their `breadth` (n,) [m]."""
    if len(positions) < 2:
        return
    distances, numbers = scipy.spatial.cKDTree(positions).query(positions, k=2)
    distance = distances[:, 1]
    closest = int(np.argmin(distance / breadth))
    if distance[closest] < ONE_PLACE * breadth[closest]:
        first, second = sorted(numbers[closest] + 1)
        raise CaseError(
            f"'{name}' has two particles at one place, those of lines {first} and {second} of its data; keep one "
            "of them",
            where="shape.file",
        )
    usual, size = float(np.median(distance)), float(np.median(breadth))
    if not 1.0 / MISFIT < usual / size < MISFIT:
        raise CaseError(
            f"particles of '{name}' are {usual:.3g} m apart, and by their masses and the material's density {size:.3g} "
            "m wide; give the right `unit`, masses (per metre of depth in 2D) or material",
            where="shape.file",
        )


def _read(path: Path, dim: int) -> tuple[np.ndarray, np.ndarray]:
    ending = path.suffix.lower()
    if ending == ".csv":
        *axes, mass = read_columns(path, (*"xyz"[:dim], "mass"))
        return np.stack(axes, axis=1), mass
    if ending in (".h5", ".hdf5"):
        with h5py.File(path, "r") as file:
            missing = [name for name in ("position", "mass") if name not in file]
            if missing:
                names = ", ".join(file)
                raise CaseError(f"'{path}' has no data set {', '.join(missing)}; it has {names}", where="shape.file")
            return np.asarray(file["position"])[:, :dim], np.asarray(file["mass"])
    import meshio

    mesh = meshio.read(path)
    if "mass" not in mesh.point_data:
        raise CaseError(f"'{path}' has no point data 'mass'; it has {', '.join(mesh.point_data)}", where="shape.file")
    return mesh.points[:, :dim], mesh.point_data["mass"]


def read_columns(path: str | Path, names: tuple[str, ...]) -> list[np.ndarray]:
    """Return columns (rows,) of a CSV file by name; raises `CaseError` for a missing one or no finite number."""
    if not Path(path).is_file():
        raise CaseError(f"there is no file '{path}'", where="file")
    if not Path(path).stat().st_size:
        raise CaseError(f"'{path}' is empty", where="file")
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=float, encoding="utf-8", ndmin=1)
    heads = table.dtype.names or ()
    missing = [name for name in names if name not in heads]
    if missing:
        raise CaseError(f"'{path}' has no column {', '.join(missing)}; it has {', '.join(heads)}", where="file")
    columns = [np.asarray(table[name]) for name in names]
    if not all(np.isfinite(column).all() for column in columns):
        raise CaseError(f"'{path}' holds a value that is no finite number", where="file")
    return columns


def interpolate(points: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return `values` (n, k) given at `points` (n, dim) at other points (m, dim): linear, outside the nearest's."""
    nearest = scipy.interpolate.NearestNDInterpolator(points, values)(at)
    if len(points) <= points.shape[1]:
        return np.asarray(nearest)
    linear = scipy.interpolate.LinearNDInterpolator(points, values)(at)
    return np.where(np.isfinite(linear), linear, nearest)
