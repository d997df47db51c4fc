"""Contact of bodies with unequal spacings and smoothing lengths: distances scaled on each side.

    d_a   depth of a below the face of its body, from |O_a| of `sph.contact.contact_normal`
    k     = (d_a/h_a + d_b/h_b) / (d_a + d_b)           1/h along the normal n
    q^2   = (k s)^2 + (t/h_ab)^2,   s = r . n,  t = |r - s n|,  h_ab = (h_a + h_b)/2
    G     = |w'(q)| norm / (h_a h_b h_ab^(dim - 1)) k s/q               in place of |dW/dr| e . n

Over touching faces the sum of G equals the missing part of the kernel sum of the own body, on both sides and for any
ratio of the spacings; with a single length the pressures of both sides would not balance. For equal lengths G = |dW/dr|
e . n. Velocity gradients and density rates of a weight the pair by k h_a, as the distance is s k h_a in units of a, and
the number density by (h_b/h_a)^dim.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add,
    broadcast,
    dot,
    exact_difference,
    exact_vector,
    lane_sums,
    multiply,
    no_vector,
    put,
    row_exact_vector,
    row_vector,
    subtract,
    vector,
)
from hvisph.compiler.vector.api import LANES, neighbours
from hvisph.sph.kernels import Kernel
from hvisph.sph.terms.limiters import TINY

# Length of the table of depths, and its largest sqrt(-2 ln(w(q)/w(0))).
DEPTH_POINTS, DEPTH_RANGE = 257, 4.0
ENTRIES = DEPTH_POINTS + 1
# Least depth over h.
DEPTH_MIN = 0.05
# Slot of what rounding takes of the position, in single precision.
X_REST = 0


def depths(kernel: Kernel, h_over_dx: float) -> np.ndarray:
    """Return tables of depth for 1, 2 and 3 dimensions, one after another, `ENTRIES` numbers each.

    Each is w(0), and the depth over h at `DEPTH_POINTS` even steps of sqrt(-2 ln(|O| h/w(0))) to `DEPTH_RANGE`, linear
    between those of the layers of a lattice: there, not over the integral, the two sums are to be the same.

    `kernel`, `h_over_dx`: kernel, and smoothing length over spacing
    """
    dx, tables = 1.0 / h_over_dx, []
    for dim in (1, 2, 3):
        deficit = kernel_deficit(kernel, h_over_dx, dim)
        integral = _plane_integral(kernel, dim)
        abscissa = np.sqrt(2.0 * np.maximum(-np.log(deficit / integral + TINY), 0.0))
        steps = np.minimum(abscissa, DEPTH_RANGE)
        first = int(np.argmax(steps >= DEPTH_RANGE)) + 1  # the first complete one stands for all deeper ones
        values = np.interp(
            np.linspace(0.0, DEPTH_RANGE, DEPTH_POINTS), [0.0, *steps[:first]], [0.0, *((np.arange(first) + 0.5) * dx)]
        )
        tables += [[integral], values]
    return np.concatenate(tables)


def kernel_deficit(kernel: Kernel, h_over_dx: float, dim: int) -> np.ndarray:
    """Return the missing kernel sum |O| h of the layers under a flat face, outermost first."""
    dx = 1.0 / h_over_dx
    layers, lateral = kernel.layers(h_over_dx, dim, dx)
    sums = [sum(-kernel.derivative(r, 1.0, dim) * x / r for r in np.hypot(x, lateral)) for x in layers[1:]]
    return np.asarray(np.cumsum(sums[::-1])[::-1] * dx**dim)


def _plane_integral(kernel: Kernel, dim: int) -> float:
    """Return the integral of W over a plane through its centre [1/h]."""
    t = (np.arange(400) + 0.5) * (kernel.reach / 400)
    if dim == 1:
        return kernel.value(0.0, 1.0, 1)
    circumference = 2.0 if dim == 2 else 2.0 * np.pi * t
    value = np.array([kernel.value(float(r), 1.0, dim) for r in t])
    return float((value * circumference).sum() * (t[1] - t[0]))


@inline
def depth(o, h, table):
    """Return the depth [m] under the face of a particle with missing kernel sum `o` [1/m], at most the support."""
    deficit = np.sqrt(dot(o, o)) * h / table[0]
    abscissa = np.sqrt(2.0 * max(-np.log(deficit + TINY), 0.0)) * ((DEPTH_POINTS - 1) / DEPTH_RANGE)
    step = min(int(abscissa), DEPTH_POINTS - 2)
    share = min(abscissa - step, 1.0)
    return h * max(table[1 + step] + share * (table[2 + step] - table[1 + step]), DEPTH_MIN)


@inline
def normal_inverse_length(depth_a, h_a, depth_b, h_b):
    """Return k [1/m], the inverse length along the normal; 0 without depths, as of a rigid body's inner particles."""
    return (depth_a / h_a + depth_b / h_b) / (depth_a + depth_b + TINY)


@inline
def stretched_distance(dx, n, inverse_length, inverse_mean):
    """Return q, s [m] and the vector t [m] of a pair."""
    s = dot(dx, n)
    t = subtract(dx, multiply(s, n))
    return np.sqrt(s * s * inverse_length * inverse_length + dot(t, t) * inverse_mean * inverse_mean), s, t


def unequal_normals(indices, n, rows, i, constants, out):
    """Write N, the contribution of other bodies, into the row of particle `i` (pass over contact particles)."""
    x, o_a = row_exact_vector(rows, i, 0, X_REST, DIM), row_vector(rows, i, N_SURFACE, DIM)
    h, own_depth = rows[i, H], rows[i, DEPTH]
    total = broadcast(no_vector(DIM))
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx = exact_difference(exact_vector(b, 0, X_REST, DIM), x, DIM)
        other = is_other_body(rows, i, b, dx)
        normal = subtract(o_a, vector(b, N_SURFACE, DIM))
        normal = multiply(1.0 / (np.sqrt(dot(normal, normal)) + TINY), normal)
        ik, im = normal_inverse_length(own_depth, h, b[DEPTH], b[H]), 2.0 / (h + b[H])
        q, s, t = stretched_distance(dx, normal, ik, im)
        factor = -other * b[V] * scale(im) / (im * im * h * b[H]) * slope(q) / (q + TINY)
        total = add(total, add(multiply(factor * s * ik, normal), multiply(factor * im * im / ik, t)))
    put(out, i, N_RAW, lane_sums(total))
