"""Quaternions and rotations.

A quaternion is (w, x, y, z), of unit length, and maps the body frame to the world frame:
``v_w = R(q) v_b``. Functions work on any leading axes.
"""

from collections.abc import Sequence

import numpy as np

from tracking.arrays import F64

FLAT = 1e-9
"""[-] Least ratio of smallest to largest singular value of vectors that span a space."""
GRAVITY = 9.81
"""[m/s2] Gravity assumed if it is not measured, as in VQF."""


def quat_multiply(a: F64, b: F64) -> F64:
    """Return the Hamilton product a b, (..., 4)."""
    aw, ax, ay, az = np.moveaxis(np.asarray(a), -1, 0)
    bw, bx, by, bz = np.moveaxis(np.asarray(b), -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def quat_left(q: F64) -> F64:
    """Return the matrix of the product ``q r`` as a function of r, (4, 4)."""
    w, x, y, z = q
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])


def quat_right(r: F64) -> F64:
    """Return the matrix of the product ``q r`` as a function of q, (4, 4)."""
    w, x, y, z = r
    return np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])


def quat_mean(q: Sequence[F64]) -> F64:
    """Return the mean of similar orientations, (4); the identity for an empty sequence."""
    if len(q) == 0:
        return np.array([1.0, 0.0, 0.0, 0.0])
    total = np.sum([r if r @ q[0] >= 0.0 else -r for r in q], axis=0)
    mean: F64 = total / np.linalg.norm(total)
    return mean


def quat_conjugate(q: F64) -> F64:
    """Return the inverse of a unit quaternion, (..., 4)."""
    inverse: F64 = np.asarray(q) * np.array([1.0, -1.0, -1.0, -1.0])
    return inverse


def quat_to_matrix(q: F64) -> F64:
    """Return the rotation matrix R_wb of q_wb, (..., 3, 3)."""
    w, x, y, z = np.moveaxis(np.asarray(q), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    matrix: F64 = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    return matrix


def rotate(q: F64, v: F64) -> F64:
    """Return R(q) v, (..., 3)."""
    rotated: F64 = (quat_to_matrix(q) @ np.asarray(v)[..., None])[..., 0]
    return rotated


def quat_from_yaw(yaw: F64 | float) -> F64:
    """Return the rotation about the vertical by a yaw [rad], (..., 4)."""
    half = 0.5 * np.asarray(yaw, dtype=np.float64)
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)


def yaw_of(q: F64) -> F64:
    """Return the heading of the body x axis, counter-clockwise from world x, (...) [rad]."""
    w, x, y, z = np.moveaxis(np.asarray(q), -1, 0)
    return np.asarray(np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)))


def best_rotation(source: F64, target: F64, *, planar: bool, reflect: bool = False) -> F64:
    """Return the R that minimises |R source - target|, the orthogonal Procrustes problem [1].

    Args:
        source: Vectors, (..., vector, 3).
        target: Vectors, (..., vector, 3).
        planar: Rotate about the vertical only.
        reflect: Also allow reflections, unless the vectors are on a line (in space: a plane),
            which is its own reflection.

    Returns:
        (..., 3, 3), R such that ``R @ source[k]`` is near ``target[k]``.

    References:
        [1] Kabsch, Acta Cryst. A32 (1976) 922; Schoenemann, Psychometrika 31 (1966) 1.
    """
    d = 2 if planar else 3
    H = np.swapaxes(target[..., :d], -1, -2) @ source[..., :d]  # noqa: N806
    U, size, Vt = np.linalg.svd(H)  # noqa: N806
    proper = size[..., -1] <= FLAT * size[..., 0] if reflect else np.ones(size.shape[:-1], bool)
    U = U.copy()  # noqa: N806
    U[..., :, -1] *= np.where(proper, np.sign(np.linalg.det(U @ Vt)), 1.0)[..., None]
    R = np.zeros((*H.shape[:-2], 3, 3))  # noqa: N806
    R[..., :d, :d] = U @ Vt
    if planar:
        R[..., 2, 2] = 1.0
    return R
