"""Tables of p and e over density and temperature: the SESAME text layout, plain CSV, and their columns.

SESAME's text: records of a header line (file, material, table number, words, ...) and numbers of 15 or 22 characters,
five a line. Record 201 holds Z, A and rho0, record 301 n_rho, n_T, the densities [g/cm^3], the temperatures [K], then
p [GPa], e [MJ/kg] and the free energy, each with the density running fastest. CSV: a line
`density,temperature,pressure,energy` in SI and a row a point.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hvisph.core.errors import CaseError

_WORDS = 5  # numbers a line


@dataclass(frozen=True, eq=False)
class Grid:
    """Pressure and energy over a grid of density and temperature."""

    density: np.ndarray  # rising, of shape (n,) [kg/m^3]
    # rising, of shape (m,), or (n, m) where the second axis of the table is entropy or energy [K]
    temperature: np.ndarray
    # of shape (n, m) [Pa], [J/kg]; the energy rises with the temperature
    pressure: np.ndarray
    energy: np.ndarray
    entropy: np.ndarray | None = None  # of shape (n, m) [J/(kg K)]; None where the table has none

    def __post_init__(self) -> None:
        shape = (len(self.density), self.temperature.shape[-1])
        if min(shape) < 4 or self.pressure.shape != shape or self.energy.shape != shape:
            raise CaseError(f"a table of {shape[0]} densities by {shape[1]} temperatures: four of each are the least")
        rises = self.temperature.ndim == 2 or (np.diff(self.temperature) > 0).all()
        if not ((np.diff(self.density) > 0).all() and rises):
            raise CaseError("densities and temperatures of a table must rise")
        if not (np.isfinite(self.pressure).all() and np.isfinite(self.energy).all()):
            raise CaseError("the table holds values that are not finite")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Grid):
            return NotImplemented
        names = ("density", "temperature", "pressure", "energy")
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in names)

    def __hash__(self) -> int:
        return hash((self.pressure.tobytes(), self.energy.tobytes()))

    def energy_at(self, density: float, temperature: float) -> float:
        """Return the energy [J/kg] at a density [kg/m^3] and a temperature [K]."""
        along = monotone(np.log(self.density), self.energy, np.array([np.log(density)]))[0][0]
        axis = self.temperature
        if axis.ndim == 2:
            axis = np.maximum.accumulate(monotone(np.log(self.density), axis, np.array([np.log(density)]))[0][0])
            axis = axis + 1e-9 * axis[-1] * np.linspace(0.0, 1.0, len(axis))  # rises also where a phase changes
        return float(monotone(axis, along, np.array([temperature]))[0][0])

    def columns(self, shares: np.ndarray, field: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return cold energy (n,), range of energy (n,), and p, or a `field`, (n, k) at `shares` (k,) of the range."""
        field = self.pressure if field is None else field
        energy = np.maximum.accumulate(self.energy, axis=1)
        # where the energy does not rise it is made to, by a millionth of its size
        energy += 1e-6 * (np.abs(energy).max(axis=1, keepdims=True) + 1.0) * np.linspace(0.0, 1e-3, energy.shape[1])
        cold, span = energy[:, 0], energy[:, -1] - energy[:, 0]
        wanted = cold[:, None] + shares * span[:, None]
        rows = [monotone(e, p, w)[0] for e, p, w in zip(energy, field, wanted, strict=True)]
        return cold, span, np.array(rows)


def monotone(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return values and slopes at `at` of the monotone cubic through (x, y), along the first axis of `y`.

    Fritsch & Carlson 1980, SIAM J. Numer. Anal. 17, 238, with the weighted harmonic mean of Fritsch & Butland 1984.
    """
    wide = (slice(None),) + (None,) * (y.ndim - 1)
    h = np.diff(x)[wide]
    secant = np.diff(y, axis=0) / h
    slope = np.empty_like(y, dtype=float)
    slope[0], slope[-1] = secant[0], secant[-1]
    first, second = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (first + second) / (first / secant[:-1] + second / secant[1:])
    slope[1:-1] = np.where(secant[:-1] * secant[1:] > 0.0, mean, 0.0)
    k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    width = (x[k + 1] - x[k])[wide]
    t = ((at - x[k])[wide]) / width
    u = t - 1.0
    value = (1 + 2 * t) * u * u * y[k] + t * t * (3 - 2 * t) * y[k + 1]
    value = value + width * (t * u * u * slope[k] + t * t * u * slope[k + 1])
    rate = 6 * t * u / width * (y[k] - y[k + 1]) + (3 * t - 1) * u * slope[k] + t * (3 * t - 2) * slope[k + 1]
    return value, rate


def read_sesame(path: Path, material: int | None = None) -> Grid:
    """Return a material's 301 table of SESAME's text, the first unless given; `CaseError` if cut short or absent."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    for number, line in enumerate(lines):
        words = line.split()
        if len(words) < 4 or words[2] != "301" or not (words[0].isdigit() and words[1].isdigit()):
            continue
        if material is not None and int(words[1]) != material:
            continue
        return _of_record(_numbers(lines[number + 1 :], int(words[3])), str(path))
    wanted = "" if material is None else f" of material {material}"
    raise CaseError(f"there is no table 301{wanted} in it", file=str(path))


def _numbers(lines: list[str], count: int) -> np.ndarray:
    """Return the first `count` numbers of a record; their width is 15 or 22 characters."""
    numbers: list[float] = []
    width = 22 if lines and len(lines[0].rstrip()) > 6 * 15 else 15
    for line in lines:
        parts = [line[k * width : (k + 1) * width] for k in range(_WORDS)]
        numbers += [float(part.replace("D", "E")) for part in parts if part.strip()]
        if len(numbers) >= count:
            break
    return np.array(numbers[:count])


def _of_record(words: np.ndarray, name: str) -> Grid:
    n, m = (int(words[0]), int(words[1])) if len(words) > 1 else (0, 0)
    if n < 1 or m < 1 or len(words) < 2 + n + m + 2 * n * m:
        raise CaseError(f"its table 301 is cut short: {len(words)} numbers for {n} by {m}", file=name)
    rho, t = words[2 : 2 + n] * 1e3, words[2 + n : 2 + n + m]
    body = words[2 + n + m :]
    p, e = (body[k * n * m : (k + 1) * n * m].reshape(m, n).T for k in (0, 1))
    keep = rho > 0.0
    s = None
    if len(body) >= 3 * n * m:
        s = entropy_of(t, e[keep] * 1e6, body[2 * n * m : 3 * n * m].reshape(m, n).T[keep] * 1e6)
    return Grid(rho[keep], t, p[keep] * 1e9, e[keep] * 1e6, s)


def entropy_of(temperature: np.ndarray, energy: np.ndarray, free_energy: np.ndarray) -> np.ndarray | None:
    """Return S = (e - A)/T (n, m) [J/(kg K)], 0 at no temperature; None for a table without free energy A [J/kg]."""
    if not free_energy.any():
        return None
    return (energy - free_energy) / np.where(temperature > 0.0, temperature, np.inf)


def read_csv(path: Path) -> Grid:
    """Return the table of a CSV file with the columns density, temperature, pressure and energy in SI."""
    try:
        data = np.genfromtxt(path, delimiter=",", names=True, encoding="utf-8")
        rho, t = np.unique(data["density"]), np.unique(data["temperature"])
        order = np.lexsort((data["temperature"], data["density"]))
        p, e = (data[name][order].reshape(len(rho), len(t)) for name in ("pressure", "energy"))
    except (ValueError, TypeError, IndexError) as error:
        raise CaseError(
            f"is no table of density,temperature,pressure,energy on a full grid ({error})", file=str(path)
        ) from None
    return Grid(rho, t, p, e)


LARGEST = 200_000_000  # [bytes]


def read_grid(path: Path, material: int | None = None) -> Grid:
    """Return the table of a file: CSV by its ending, otherwise SESAME's text."""
    if not path.is_file():
        raise CaseError("there is no such file", file=str(path))
    if path.stat().st_size > LARGEST:
        raise CaseError(f"is larger than {LARGEST / 1e6:g} MB, too large for a table", file=str(path))
    try:
        return read_csv(path) if path.suffix == ".csv" else read_sesame(path, material)
    except (OSError, ValueError, OverflowError, IndexError):  # the message repeats nothing of the file
        raise CaseError("cannot be read as a table of an equation of state", file=str(path)) from None
