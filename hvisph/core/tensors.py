"""Compiled algebra of symmetric 3x3 tensors (components in the order xx, yy, zz, xy, xz, yz)."""

from __future__ import annotations

from .jit import compiled


@compiled
def double_dot(a_xx, a_yy, a_zz, a_xy, a_xz, a_yz, b_xx, b_yy, b_zz, b_xy, b_xz, b_yz):
    """Return A:B, the sum of the products of all nine components."""
    return a_xx * b_xx + a_yy * b_yy + a_zz * b_zz + 2.0 * (a_xy * b_xy + a_xz * b_xz + a_yz * b_yz)
