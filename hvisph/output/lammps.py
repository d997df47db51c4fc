"""Particles of LAMMPS in its text dumps: the last moment of a file.

Columns are named by the file (``ITEM: ATOMS id type x y z vx ...``); scaled (xs), unwrapped (xu) and scaled unwrapped
(xsu) coordinates are understood, and ``c_``, ``v_`` and ``f_`` before the name of a compute, variable or fix left out.
Format: https://docs.lammps.org/dump.html
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from hvisph.core.errors import OutputError

from .atomic_write import reason
from .foreign import snapshot_of_another_code
from .foreign_names import SI, Convention
from .snapshot import Snapshot

MOMENT = b"ITEM: TIMESTEP"


def read_lammps(path: str | Path, convention: Convention = SI) -> Snapshot:
    """Read the last moment of a LAMMPS text dump.

    Raises
    ------
    OutputError
        When the file is missing, truncated, damaged, or its particles have no positions.
    """
    try:
        content = Path(path).read_bytes()
        items, columns, rows = _items(content[max(content.rfind(MOMENT), 0) :].decode("ascii"))
        arrays = {re.sub(r"^[cvf]_", "", name): values for name, values in zip(columns, rows.T, strict=True)}
        points = _positions(arrays, items)
        told = {"time": np.array([float(items["TIME"][0])])} if "TIME" in items else {}
        step = int(items["TIMESTEP"][0])
        return snapshot_of_another_code(points, arrays, told, convention, step)
    except OutputError as error:
        raise OutputError(f"cannot read {path}: {error}") from error
    except OSError as error:
        raise OutputError(f"cannot read {path}: {reason(error)}") from error
    except (ValueError, LookupError) as error:
        what = f"it is truncated, damaged or no text dump of LAMMPS ({error})"
        raise OutputError(f"cannot read {path}: {what}") from error


def _items(text: str) -> tuple[dict[str, list[str]], list[str], np.ndarray]:
    """Return the lines of each item but the particles by its name, the particles' columns and numbers (n, columns)."""
    items: dict[str, list[str]] = {}
    for part in text.split("ITEM: ")[1:]:
        head, _, body = part.partition("\n")
        name = re.match(r"[A-Z ]*[A-Z]", head)
        if name is None:
            raise ValueError(f"item '{head[:30]}'")
        if name[0] == "ATOMS":
            columns, count = head.split()[1:], int(items["NUMBER OF ATOMS"][0])
            lines = [line.split() for line in body.splitlines() if line.strip()]
            if len(lines) != count or any(len(line) != len(columns) for line in lines):
                raise ValueError(f"{count} particles of {len(columns)} columns were announced")
            kept = [k for k in range(len(columns)) if all(_is_number(line[k]) for line in lines)]
            numbers = np.array([[float(line[k]) for k in kept] for line in lines]).reshape(count, len(kept))
            return items, [columns[k] for k in kept], numbers
        items[name[0]] = body.splitlines()
    raise ValueError("it has no particles")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _positions(arrays: dict[str, np.ndarray], items: dict[str, list[str]]) -> np.ndarray:
    """Take the positions (n, 3) out of the columns."""
    boxes = [[float(one) for one in line.split()] for line in items["BOX BOUNDS"][:3]]
    if any(len(box) > 2 for box in boxes):
        raise OutputError("its box is not rectangular")
    axes: list[np.ndarray] = []
    for axis, box in zip("xyz", boxes, strict=True):
        name = next((axis + end for end in ("u", "", "su", "s") if axis + end in arrays), None)
        if name is None and axis == "z":
            axes.append(np.zeros(len(axes[0])))
            continue
        if name is None:
            raise OutputError(f"its particles have no '{axis}', '{axis}u' or '{axis}s'")
        values = arrays.pop(name)
        axes.append(box[0] + values * (box[1] - box[0]) if name.endswith("s") or name.endswith("su") else values)
    return np.stack(axes, axis=1)
