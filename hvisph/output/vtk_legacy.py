"""Points of other codes in VTK's legacy files, text or binary: POLYDATA and UNSTRUCTURED_GRID.

Binary numbers are big-endian. Cells, cell data, look-up tables and metadata are passed over.
Format: https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hvisph.core.errors import OutputError

from .atomic_write import reason
from .foreign import snapshot_of_another_code
from .foreign_names import SI, Convention
from .snapshot import Snapshot

TYPES = {"unsigned_char": "u1", "char": "i1", "unsigned_short": ">u2", "short": ">i2", "unsigned_int": ">u4",
         "int": ">i4", "unsigned_long": ">u8", "long": ">i8", "vtktypeint64": ">i8", "vtktypeuint64": ">u8",
         "vtkidtype": ">i8", "float": ">f4", "double": ">f8"}  # fmt: skip
CELLS = ("VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS", "CELLS")
WIDTH = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6}


def read_vtk(path: str | Path, convention: Convention = SI) -> Snapshot:
    """Read another code's points from a legacy VTK file.

    Raises
    ------
    OutputError
        When the file is missing, truncated, damaged, or its points are those of a structured grid.
    """
    try:
        points, data, told = _Legacy(Path(path).read_bytes()).arrays()
        return snapshot_of_another_code(points, data, told, convention)
    except OutputError as error:
        raise OutputError(f"cannot read {path}: {error}") from error
    except OSError as error:
        raise OutputError(f"cannot read {path}: {reason(error)}") from error
    except (ValueError, LookupError, TypeError) as error:
        raise OutputError(f"cannot read {path}: it is truncated or damaged ({error})") from error


class _Legacy:
    """The content of a file, and how far it has been read."""

    def __init__(self, content: bytes):
        self.content, self.at = content, 0
        self._line(), self._line()  # version and title
        self.binary = self._line().strip().upper() == "BINARY"
        kind = self._words()
        if kind[:1] != ["DATASET"] or kind[1].upper() not in ("POLYDATA", "UNSTRUCTURED_GRID"):
            raise OutputError(f"it holds {' '.join(kind) or 'nothing'}; read are POLYDATA and UNSTRUCTURED_GRID")

    def arrays(self) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Return points (n, 3), arrays by name with one row a point, and the file's own arrays."""
        points: np.ndarray | None = None
        data: dict[str, np.ndarray] = {}
        told: dict[str, np.ndarray] = {}
        into, count = told, 0
        while words := self._words():
            key = words[0].upper()
            if key == "POINTS":
                points = self._values(words[2], 3 * int(words[1])).reshape(-1, 3)
            elif key in CELLS:
                self._cells(int(words[1]), int(words[2]))
            elif key == "CELL_TYPES":
                self._values("int", int(words[1]))
            elif key == "METADATA":
                self._skip_metadata()
            elif key in ("POINT_DATA", "CELL_DATA"):
                into, count = data if key == "POINT_DATA" else {}, int(words[1])
            elif key == "FIELD":
                for _ in range(int(words[2])):
                    name, width, number, kind = self._field_head()
                    into[name] = self._values(kind, width * number).reshape(-1, width)
            else:
                self._attribute(key, words, into, count)
        if points is None:
            raise OutputError("it holds no points")
        if any(len(values) != len(points) for values in data.values()):
            raise OutputError("it is truncated or damaged: an array has not a row for every point")
        return points, data, told

    def _field_head(self) -> tuple[str, int, int, str]:
        words = self._words()
        while words and words[0].upper() == "METADATA":
            self._skip_metadata()
            words = self._words()
        return words[0], int(words[1]), int(words[2]), words[3]

    def _attribute(self, key: str, words: list[str], into: dict[str, np.ndarray], count: int) -> None:
        if key == "SCALARS":
            width = int(words[3]) if len(words) > 3 else 1
            back = self.at
            if self._words()[:1] != ["LOOKUP_TABLE"]:
                self.at = back
            into[words[1]] = self._values(words[2], width * count).reshape(-1, width)
        elif key in WIDTH:
            into[words[1]] = self._values(words[2], WIDTH[key] * count).reshape(-1, WIDTH[key])
        elif key == "LOOKUP_TABLE":
            self._values("unsigned_char" if self.binary else "float", 4 * int(words[2]))
        else:
            raise OutputError(f"it is damaged, or of a kind that is not read: '{words[0][:30]}'")

    def _cells(self, first: int, second: int) -> None:
        """Pass over cells, of either version of the format."""
        back = self.at
        words = self._words()
        if words[:1] != ["OFFSETS"]:
            self.at = back
            self._values("int", second)
            return
        self._values(words[1], first)
        self._values(self._words()[1], second)

    def _skip_metadata(self) -> None:
        while self._line().strip():
            pass

    def _values(self, kind: str, number: int) -> np.ndarray:
        form = np.dtype(TYPES[kind.lower()])
        if self.binary:
            values = np.frombuffer(self.content, form, number, self.at)
            self.at += number * form.itemsize
            return values.astype(form.newbyteorder("="))
        words: list[bytes] = []
        while len(words) < number:
            end = self.content.find(b"\n", self.at)
            end = len(self.content) if end < 0 else end
            if self.at >= end and self.at >= len(self.content):
                raise ValueError(f"{number} numbers were announced, {len(words)} are there")
            words += self.content[self.at : end].split()
            self.at = end + 1
        return np.array(words, dtype="S").astype(float).astype(form.newbyteorder("="))

    def _words(self) -> list[str]:
        """Return the words of the next line that has any; none at the end."""
        while self.at < len(self.content):
            words = self._line().split()
            if words:
                return words
        return []

    def _line(self) -> str:
        end = self.content.find(b"\n", self.at)
        end = len(self.content) if end < 0 else end
        line, self.at = self.content[self.at : end], end + 1
        return line.decode("ascii", "replace")
