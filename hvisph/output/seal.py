"""A checksum at the very end of a file: tells a whole file from a truncated or damaged one.

The seal is one line, an XML comment with the CRC-32 of every byte before it. HDF5 ignores what follows
its data and XML allows a comment after the last element, so the same seal serves both formats, and a
damaged file is recognised before any library parses it.
"""

from __future__ import annotations

import zlib
from typing import BinaryIO

from hvisph.core.errors import OutputError

_START = b"<!-- hvisph crc32 "
_END = b" -->\n"
SEAL_LENGTH = len(_START) + 8 + len(_END)
_CHUNK = 1 << 20


def append_seal(file: BinaryIO) -> None:
    """Add the seal to `file`, open for reading and writing, over all that it holds."""
    file.seek(0, 2)
    checksum = _crc32(file, file.tell())
    file.seek(0, 2)
    file.write(_START + f"{checksum:08x}".encode() + _END)


def has_seal(file: BinaryIO) -> bool:
    """Tell whether `file`, open for reading, ends with a seal, fitting or not, and go back to its start."""
    length = file.seek(0, 2) - SEAL_LENGTH
    file.seek(max(length, 0))
    seal = file.read(SEAL_LENGTH)
    file.seek(0)
    return length >= 0 and seal.startswith(_START) and seal.endswith(_END)


def verify_seal(file: BinaryIO) -> None:
    """Check the seal of `file`, open for reading, and go back to its start.

    Raises
    ------
    OutputError
        When there is no seal or the bytes do not fit it.
    """
    if not has_seal(file):
        raise OutputError("it is truncated, or was changed after it was written (no checksum at its end)")
    length = file.seek(-SEAL_LENGTH, 2)
    stated = file.read(SEAL_LENGTH)[len(_START) : -len(_END)]
    computed = f"{_crc32(file, length):08x}".encode()
    file.seek(0)
    if computed != stated:
        raise OutputError("it is damaged, or was changed after it was written (its checksum does not fit)")


def _crc32(file: BinaryIO, length: int) -> int:
    """Return the CRC-32 of the first `length` bytes of `file`."""
    file.seek(0)
    checksum = 0
    while length > 0 and (chunk := file.read(min(_CHUNK, length))):
        checksum = zlib.crc32(chunk, checksum)
        length -= len(chunk)
    return checksum
