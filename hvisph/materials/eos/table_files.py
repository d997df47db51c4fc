"""Tables of ANEOS and its relatives, as planetary codes write them.

`aneos`: SESAME text of Stewart's ANEOS, six lines of header, then n_rho, n_T, rho [g/cm^3], T [K], p [GPa], e [MJ/kg],
five numbers of 16 columns a line, density fastest. `miluphcuda`: rows rho e p T c S phase in SI, energy fastest.
`gadget`: n_rho, n_S, rho, S, p, T, e, c over entropy and density in cgs, density fastest. `woma` (also SWIFT): a date,
n_rho n_T, a line of rho, a line of T, rows e p c s in SI, density fastest.
"""

from pathlib import Path

import numpy as np

from hvisph.core.errors import CaseError

from .grid import LARGEST, Grid, entropy_of, read_grid

AMBIENT = 300.0  # [K]
STIFF = 10.0  # d ln p/d ln rho that no gas has: it is K/p just above the density of zero pressure
WARM = 1000.0  # [K]; mean heat capacities are taken up to it
CAPACITIES = 20.0, 2e4  # of condensed matter lie between [J/(kg K)]; uranium has 116, hydrogen 14,000
MODULI = 1e8, 1e12  # bulk moduli of condensed matter lie between [Pa]; diamond has 4.4e11


def read_table(path: Path, form: str | None = None, number: int | None = None) -> Grid:
    """Return a table in the layout `form`, detected unless given; `CaseError` for a file that does not fit it."""
    if path.name.upper().startswith("ANEOS.INPUT") or path.suffix.lower() == ".aneos":
        raise CaseError(
            "is the input of ANEOS, not a table: run ANEOS with it and give the table that it writes, "
            "such as NEW-SESAME-STD.TXT",
            file=str(path),
        )
    if form == "sesame" or path.suffix == ".csv" or not path.is_file() or path.stat().st_size > LARGEST:
        return read_grid(path, number)
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
        form = form or _layout(lines)
        if form in READERS:
            return READERS[form](lines)
    except (OSError, ValueError, OverflowError, IndexError):  # the message repeats nothing of the file
        raise CaseError(f"cannot be read as a table in the layout {form or 'of any program'}", file=str(path)) from None
    except CaseError as error:
        raise CaseError(error.message, file=str(path)) from None
    try:
        return read_grid(path, number)
    except CaseError as error:
        hint = f"{error.message}; if another program wrote it, give its `format`: {', '.join(READERS)}"
        raise CaseError(hint, file=str(path)) from None


def _layout(lines: list[str]) -> str:
    """Return the layout of a text; `sesame` where it is none of this module's."""
    if any("RECORD" in line and "301" in line for line in lines[:6]):
        return "aneos"
    if lines and lines[0].startswith("#"):
        rows = [line.split() for line in lines[:40] if line.strip() and not line.startswith("#")]
        return "woma" if len(rows[0]) == 1 else "miluphcuda"
    words = " ".join(lines).split()
    n, m = (int(word) if word.isdigit() else 0 for word in [*words, "", ""][:2])
    return "gadget" if n * m > 0 and len(words) == 2 + n + m + 4 * n * m else "sesame"


def _take(words: np.ndarray, n: int, m: int, fields: int) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Return the two axes and `fields` arrays of shape (n, m) behind two numbers n and m, density fastest."""
    if min(n, m) < 1 or len(words) != n + m + fields * n * m:
        raise CaseError(
            f"does not fit: {len(words)} numbers for {n} by {m}, of which {fields} fields need {n + m + fields * n * m}"
        )
    return words[:n], words[n : n + m], [one.reshape(m, n).T for one in np.split(words[n + m :], fields)]


def _read_aneos(lines: list[str]) -> Grid:
    parts = [line[k : k + 16] for line in lines[6:] for k in range(0, 80, 16)]
    words = np.array([float(part) for part in parts if part.strip()])
    n, m = int(words[0]), int(words[1])
    if len(words) == 2 + n + m + 4 * n * m:
        raise CaseError("holds entropy and sound speed, not pressure; give the standard table (-STD) beside it")
    rho, temperature, (p, e, free) = _take(words[2:], n, m, 3)
    return _grid(rho * 1e3, temperature, p * 1e9, e * 1e6, entropy_of(temperature, e * 1e6, free * 1e6))


def _read_miluphcuda(lines: list[str]) -> Grid:
    rows = np.array([line.split()[:6] for line in lines if line.strip() and not line.startswith("#")], dtype=float)
    rho = np.unique(rows[:, 0])
    if len(rows) % len(rho):
        raise CaseError(f"does not fit: {len(rows)} rows for {len(rho)} densities, each with the same energies")
    at, e, p, temperature, *further = (rows[:, k].reshape(len(rho), -1) for k in range(rows.shape[1]))
    if (at != rho[:, None]).any() or (e != e[0]).any():
        raise CaseError("does not fit: density must rise from block to block, each with the same energies")
    return _grid(rho, temperature, p, e, further[1] if len(further) == 2 else None)


def _read_gadget(lines: list[str]) -> Grid:
    words = np.array(" ".join(lines).split(), dtype=float)
    rho, s, (p, temperature, e, _) = _take(words[2:], int(words[0]), int(words[1]), 4)
    return _grid(rho * 1e3, temperature, p * 0.1, e * 1e-4, np.broadcast_to(s * 1e-4, p.shape))


def _read_woma(lines: list[str]) -> Grid:
    words = np.array(" ".join(line for line in lines if not line.startswith("#")).split(), dtype=float)
    n, m = int(words[1]), int(words[2])
    body = words[3 + n + m :]
    fields = body.reshape(-1, 4).T.ravel()
    rho, temperature, (e, p, _, s) = _take(np.concatenate([words[3 : 3 + n + m], fields]), n, m, 4)
    return _grid(rho, temperature, p, e, s)


READERS = {"aneos": _read_aneos, "miluphcuda": _read_miluphcuda, "gadget": _read_gadget, "woma": _read_woma}


def _grid(rho: np.ndarray, temperature: np.ndarray, p: np.ndarray, e: np.ndarray, s: np.ndarray | None = None) -> Grid:
    keep = rho > 0.0
    temperature = temperature[keep] if temperature.ndim == 2 else temperature
    return Grid(rho[keep], temperature, p[keep], e[keep], None if s is None or not s.any() else s[keep])


def check_units(grid: Grid, density: float) -> None:
    """Refuse a condensed table whose density, modulus or heat capacity without pressure is off by powers of ten."""
    rho = grid.density
    temperature = np.broadcast_to(grid.temperature, grid.pressure.shape)
    p = np.array([np.interp(AMBIENT, t, of_t) for t, of_t in zip(temperature, grid.pressure, strict=True)])
    at = int(np.flatnonzero(p[:-1] <= 0.0)[-1]) if (p[:-1] <= 0.0).any() else -1
    if at < 0:
        slope = np.diff(np.log(p)) / np.diff(np.log(rho))
        at = int(np.argmax(slope))
        if slope[at] < STIFF:
            return
    ratio = rho[at] / density
    if not 0.2 < ratio < 5.0:
        power = round(float(np.log10(ratio)))
        likely = "g/cm^3 taken for kg/m^3, or the reverse" if abs(power) == 3 else "another unit or material"
        fault = f"has no pressure at {rho[at]:g} kg/m^3, 10^{power} times the material's density {density:g}"
        raise CaseError(f"{fault}: likely {likely}; check the `format`")
    last, t, e = min(at + 2, len(rho) - 1), temperature[at], grid.energy[at]
    warm = int(np.clip(np.searchsorted(t, WARM), 1, len(t) - 1))
    modulus, capacity = rho[at] * (p[last] - p[at]) / (rho[last] - rho[at]), (e[warm] - e[0]) / (t[warm] - t[0])
    for what, value, unit, (low, high), likely in (
        ("bulk modulus", modulus, "Pa", MODULI, "pressures in GPa or dyn/cm^2 taken for Pa"),
        ("heat capacity", capacity, "J/(kg K)", CAPACITIES, "energies in MJ/kg or erg/g taken for J/kg"),
    ):
        if not low < value < high:
            fault = f"has a {what} of {value:.3g} {unit} at zero pressure, which no condensed matter has"
            raise CaseError(f"{fault} ({low:g} to {high:g}): likely {likely}, or the reverse; check the `format`")
