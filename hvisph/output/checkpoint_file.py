"""Checkpoints in HDF5 files with a checksum.

A file contains arrays by name and a header in JSON, nothing that can be executed. The last two are kept,
named by their step: if the newer one is damaged the older one is used.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hvisph import __version__
from hvisph.core.errors import CaseError, OutputError
from hvisph.core.fields import Derived
from hvisph.core.text import Plain, PlainMapping

from . import file_names
from .verified_hdf5 import reading, writing

FORMAT_VERSION = 7
KEPT = 2
_HEADER = "header"
_ARRAYS = "arrays"
_PIECE = 8_192  # rows


@dataclass(frozen=True)
class Checkpoint:
    """A run between two steps."""

    step: int  # number of steps done
    header: Plain  # JSON data
    # arrays by name, those to be written also `Ordered` or else fetched by slices; names may be paths, as
    # ``history/rows``
    arrays: PlainMapping


def write_checkpoint(folder: str | Path, checkpoint: Checkpoint) -> Path:
    """Write a checkpoint and delete all but the last two; on `OutputError` earlier ones are unchanged."""
    path = Path(folder) / f"{checkpoint.step:012d}.h5"
    form = {"format_version": FORMAT_VERSION, "code_version": __version__, "step": checkpoint.step}
    header = json.dumps(form | {"content": checkpoint.header}).encode("ascii")
    with writing(path) as h5:
        h5.create_dataset(_HEADER, data=np.frombuffer(header, np.uint8))
        for name in checkpoint.arrays:  # one at a time
            values = checkpoint.arrays[name]
            if isinstance(values, np.ndarray):
                h5.create_dataset(f"{_ARRAYS}/{name}", data=values)
                continue
            dataset = h5.create_dataset(f"{_ARRAYS}/{name}", values.shape, values.dtype)
            for begin in range(0, len(values), _PIECE):
                dataset[begin : begin + _PIECE] = values[begin : begin + _PIECE]
    earlier = [file for file in list_checkpoints(folder) if file.name < path.name]
    for file in list_checkpoints(folder):
        if file.name not in {path.name, *(recent.name for recent in earlier[: KEPT - 1])}:
            with suppress(OSError):  # an additional one does no harm
                file.unlink()
    return path


def list_checkpoints(folder: str | Path) -> list[Path]:
    """Return the checkpoints in `folder`, newest first, without links, foreign files and those being written."""
    pattern = file_names.PATTERNS[file_names.CHECKPOINT]
    files = [path for path in Path(folder).glob("*.h5") if pattern.fullmatch(path.name) and file_names.is_plain(path)]
    return sorted(files, key=lambda path: int(path.stem), reverse=True)


def read_checkpoint(path: str | Path, lazily: bool = False) -> Checkpoint:
    """Read a checkpoint after verifying its checksum; `lazily`: read arrays on each access.

    Raises `OutputError` when it is missing, truncated, damaged or of another kind; `CaseError` for another version.
    """
    with reading(path, "a checkpoint") as h5:
        header = json.loads(h5[_HEADER][...].tobytes())
        if not isinstance(header, dict) or not isinstance(header["step"], int):
            raise ValueError("its header is none")
        for key, version in (("code_version", __version__), ("format_version", FORMAT_VERSION)):
            if header[key] != version:
                raise CaseError(
                    f"cannot go on from {path}: its {key} is {header[key]}, and this is {version}; "
                    "a run continues with the version that began it"
                )
        arrays: dict[str, np.ndarray] = {}

        def keep(name: str, node: Any) -> None:
            if hasattr(node, "shape"):
                arrays[name] = node[...] if not lazily else np.zeros(0)

        h5[_ARRAYS].visititems(keep)
        content = dict(header["content"])

    def array(name: str) -> np.ndarray:
        with reading(path, "a checkpoint", verified=False) as h5:
            return np.asarray(h5[_ARRAYS][name][...])

    return Checkpoint(int(header["step"]), content, Derived(arrays, array) if lazily else arrays)


def newest_checkpoint(folder: str | Path, report: Callable[[str], None], lazily: bool = False) -> Checkpoint | None:
    """Return the newest undamaged checkpoint; None if there is no checkpoint.

    `report`: called with the reason for each that is skipped.
    Raises `OutputError` when there are some and none is whole; `CaseError` when another version of hvisph wrote it.
    """
    files = list_checkpoints(folder)
    for number, path in enumerate(files):
        try:
            return read_checkpoint(path, lazily)
        except OutputError as error:
            if number + 1 == len(files):
                raise OutputError(f"{error}; there is no other checkpoint to go on from") from error
            report(f"{error}; going on from the checkpoint before it")
    return None
