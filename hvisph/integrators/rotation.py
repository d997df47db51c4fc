"""Rotations as unit quaternions (w, x, y, z), and the free rotation of a rigid body.

The free flow keeps L in space and turns the body about its principal axes one after another, 1 (h/2), 2 (h/2), 3 (h),
2 (h/2), 1 (h/2), by the angle h L_k/I_k: of second order and reversible; its energy oscillates by O(dt^2). A body that
may turn about one axis only, as in a plane, has one angle, which is exact.

Source: Dullweber, Leimkuhler & McLachlan 1997.
"""

from math import cos, sin

import numpy as np

AXES = np.eye(3)
# Axes of the turns of a free flow, and their shares of it.
SPLITTING = ((0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5))


def rotation(q: np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3), body to space, of the unit quaternion `q` (4,)."""
    w, x, y, z = q.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion(axes: np.ndarray) -> np.ndarray:
    """Return the unit quaternion (4,) of a rotation matrix (3, 3), by the largest of its four numbers."""
    diagonal = np.diag(axes)
    squares = np.array([diagonal.sum(), *(2.0 * diagonal - diagonal.sum())]) + 1.0  # 4 q^2
    odd = [axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]]
    k = int(np.argmax(squares))
    q = np.array([0.0, *odd] if k == 0 else [odd[k - 1], *(axes[k - 1] + axes[:, k - 1])])
    q[k] = squares[k]
    return q / np.sqrt((q * q).sum())


def turn_about(q: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the quaternion `q` (4,), turned before by `angle` about `axis` (3,) in the body, of length 1."""
    w, (x, y, z), (q0, q1, q2, q3) = cos(0.5 * angle), (sin(0.5 * angle) * axis).tolist(), q.tolist()
    result = np.array(
        [
            q0 * w - q1 * x - q2 * y - q3 * z,
            q0 * x + q1 * w + q2 * z - q3 * y,
            q0 * y - q1 * z + q2 * w + q3 * x,
            q0 * z + q1 * y - q2 * x + q3 * w,
        ]
    )
    return result / np.sqrt((result * result).sum())


def flow(q: np.ndarray, spin: np.ndarray, inertia: np.ndarray, time: float) -> np.ndarray:
    """Return the quaternion after a free rotation over `time` [s].

    `q`: unit quaternion (4,), principal axes to space
    `spin`, `inertia`: angular momentum in space (3,) [kg m^2/s], and principal moments (3,) [kg m^2]
    """
    body_spin, moments = (spin @ rotation(q)).tolist(), inertia.tolist()
    for k, share in SPLITTING:
        angle = share * time * body_spin[k] / moments[k]
        q = turn_about(q, AXES[k], angle)
        i, j, c, s = (k + 1) % 3, (k + 2) % 3, cos(angle), sin(angle)
        body_spin[i], body_spin[j] = c * body_spin[i] + s * body_spin[j], c * body_spin[j] - s * body_spin[i]
    return q
