"""Long tables in compiled scalar functions: numbers read by address.

An array that is alive across branches costs numba atomic reference counts. The address of one of its rows is a plain
number and is passed as a float: addresses have 48 bits, floats 53. Both functions work alike in compiled code and in
plain Python. The caller keeps the array alive; in a run the stepper holds the table.
"""

from __future__ import annotations

import ctypes
from typing import Any


def row_address(table: Any, m: Any) -> float:
    """Return the address of row `m` of `table`, a float64 array of shape (rows, columns) in C order."""
    return float(table.ctypes.data + int(m) * table.strides[0])


def number_at(address: float, k: int) -> float:
    """Return the float64 number with index `k` behind `address`."""
    return ctypes.c_double.from_address(int(address) + 8 * k).value
