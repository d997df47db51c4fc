"""HDF5 files with a checksum at their end, written to a temporary name and renamed.

The checksum is one line: an XML comment with the CRC-32 of all bytes before it. HDF5 ignores what follows its data and
XML allows a comment after the last element, so that both formats have the same checksum, and a damaged file is
recognised before any library parses it.

The checksum detects damage, not intent. Therefore the content of a file is checked before it is read: only groups and
plain arrays inside the file, no larger than it, are accepted.
"""

import io
import os
import time as clock
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import h5py

from hvisph.core.errors import OutputError

from .atomic_write import read_errors, replacing

_START = b"<!-- hvisph crc32 "
_END = b" -->\n"
CHECKSUM_LENGTH = len(_START) + 8 + len(_END)
_CHUNK = 1 << 20


def append_checksum(file: BinaryIO) -> None:
    """Append the checksum of its content to `file`, open for reading and writing."""
    file.seek(0, 2)
    checksum = _crc32(file, file.tell())
    file.seek(0, 2)
    file.write(_START + f"{checksum:08x}".encode() + _END)


def has_checksum(file: BinaryIO) -> bool:
    """Return whether `file`, open for reading, ends with a checksum, right or wrong, and rewind it."""
    length = file.seek(0, 2) - CHECKSUM_LENGTH
    file.seek(max(length, 0))
    line = file.read(CHECKSUM_LENGTH)
    file.seek(0)
    return length >= 0 and line.startswith(_START) and line.endswith(_END)


def verify_checksum(file: BinaryIO) -> None:
    """Check the checksum of an open `file` and rewind it; raises `OutputError` where it is missing or wrong."""
    if not has_checksum(file):
        raise OutputError("it is truncated, or was changed after it was written (no checksum at its end)")
    length = file.seek(-CHECKSUM_LENGTH, 2)
    stored = file.read(CHECKSUM_LENGTH)[len(_START) : -len(_END)]
    computed = f"{_crc32(file, length):08x}".encode()
    file.seek(0)
    if computed != stored:
        raise OutputError("it is damaged, or was changed after it was written (its checksum does not fit)")


def _crc32(file: BinaryIO, length: int) -> int:
    """Return the CRC-32 of the first `length` bytes of `file`."""
    file.seek(0)
    checksum = 0
    while length > 0 and (chunk := file.read(min(_CHUNK, length))):
        checksum = zlib.crc32(chunk, checksum)
        length -= len(chunk)
    return checksum


SIGNATURE = b"\x89HDF\r\n\x1a\n"
MOST_OBJECTS = 1000  # groups and arrays; a snapshot has some thirty
MOST_LEVELS = 8
MOST_REMEMBERED = 10_000  # entries of `_CHECKED`
CLOCK_GRAIN = 2.0  # [s] after which a change is visible in the time of a file
State = tuple[int, int, int, int]  # device, number, size and time of a file
_CHECKED: dict[State, bool] = {}  # files whose content was checked, and whether their checksum was
MOST_COMPRESSION = 1100  # above the largest ratio of deflate, 1032
LABELS = ("body_names", "material_names")  # texts in a snapshot, for ParaView


@contextmanager
def writing(path: str | Path) -> Iterator[h5py.File]:
    """Return a context with an `h5py.File` that replaces `path`, with checksum, if the block ends without an error."""
    with replacing(path) as file:
        sink = _GuardedFile(file)
        try:
            with h5py.File(sink, "w") as h5:
                yield h5
        except (OSError, RuntimeError):
            if sink.error is None:
                raise
        if sink.error is not None:
            raise sink.error
        append_checksum(file)


@contextmanager
def reading(path: str | Path, what: str, *, verified: bool = True) -> Iterator[h5py.File]:
    """Return a context with an open file, called `what` in messages; `verified`: verify its checksum, once.

    Raises `OutputError` when it is missing, truncated, damaged or of another kind, and for errors of its content.
    """
    with read_errors(path, f"{what} of hvisph"), Path(path).open("rb") as file:
        if file.read(len(SIGNATURE)) != SIGNATURE:
            raise OutputError("it is not an HDF5 file")
        status = os.fstat(file.fileno())
        state = status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns
        checked = _CHECKED.get(state)
        if verified and not checked:
            verify_checksum(file)
        elif checked is None and not has_checksum(file):
            raise OutputError("it is truncated, or was changed after it was written (no checksum at its end)")
        file.seek(0)
        with h5py.File(file, "r") as h5:
            if checked is None:
                _refuse_foreign_content(h5, file.seek(0, 2))
            _record_state(state, valid=verified or bool(checked))
            yield h5


def _record_state(state: State, valid: bool) -> None:
    """Record that the content of a file was checked, and whether its checksum was (`valid`), until it is replaced."""
    if clock.time() - 1e-9 * state[3] > CLOCK_GRAIN:  # within the clock's grain a change would not show
        _CHECKED[state] = valid
        while len(_CHECKED) > MOST_REMEMBERED:
            del _CHECKED[next(iter(_CHECKED))]


def _refuse_foreign_content(h5: h5py.File, size: int) -> None:
    """Raise `OutputError` unless all in `h5` is a group or a plain array inside the file, of `size` bytes in all."""
    groups, count, claimed = [(h5, 0)], 0, 0
    while groups:
        group, depth = groups.pop()
        for name in group:
            count += 1
            if count > MOST_OBJECTS or depth > MOST_LEVELS:
                raise OutputError("it holds more objects, or deeper ones, than hvisph writes")
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise OutputError(f"'{name}' in it is a link to elsewhere, which hvisph neither writes nor follows")
            node = group[name]
            if isinstance(node, h5py.Group):
                groups.append((node, depth + 1))
                continue
            _refuse_external(node, name)
            stored = int(node.id.get_storage_size() if node.chunks else node.nbytes)
            claimed += stored
            if claimed > size or node.nbytes > MOST_COMPRESSION * stored:
                raise OutputError(f"'{name}' claims more than the file holds")


def _refuse_external(node: object, name: str) -> None:
    """Raise `OutputError` unless `node` is an array of plain values inside the file."""
    if not isinstance(node, h5py.Dataset):
        raise OutputError(f"'{name}' in it is no array")
    properties = node.id.get_create_plist()
    is_plain = properties.get_layout() in (h5py.h5d.CONTIGUOUS, h5py.h5d.COMPACT) and not properties.get_nfilters()
    filters = {properties.get_filter(k)[0] for k in range(properties.get_nfilters())}
    is_plain = is_plain or (node.chunks is not None and filters <= {h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_DEFLATE})
    is_plain = is_plain and not properties.get_external_count()
    if name in LABELS and h5py.check_string_dtype(node.dtype) is not None and node.size <= MOST_OBJECTS:
        return  # for other programs: hvisph never reads them
    if not is_plain or node.dtype.kind not in "fiubS" or node.dtype.hasobject:
        raise OutputError(f"'{name}' in it is no plain array inside the file, and hvisph writes no other")


class _GuardedFile(io.RawIOBase):
    """File for HDF5 that discards all writes after the first failure, `error`, which the writer raises afterwards.

    HDF5 cannot close a file whose writes fail (disk full) and would report errors at the end of the program.
    """

    def __init__(self, file: BinaryIO):
        self._file = file
        self.error: OSError | None = None

    def write(self, data: Any, /) -> int:
        size = memoryview(data).nbytes
        if self.error is None:
            try:
                self._file.write(data)
            except OSError as error:
                self.error = error
        return size

    def readinto(self, buffer: object, /) -> int:
        return self._file.readinto(buffer)  # type: ignore[attr-defined]

    def seek(self, offset: int, whence: int = 0, /) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def truncate(self, size: int | None = None, /) -> int:
        try:
            return self._file.truncate(size)
        except OSError as error:
            self.error = self.error or error
            return size or 0

    def flush(self) -> None:
        if self._file.closed:  # by the garbage collector
            return
        try:
            self._file.flush()
        except OSError as error:
            self.error = self.error or error
