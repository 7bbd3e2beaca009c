"""Modes of a quadratic function of a matrix over all rotations and reflections.

    f(R) = score . (R - 1) - (R - 1) . information (R - 1) / 2

with the elements of R row by row. They are found by Newton's method on O(3) from many starts, in
steps ``exp(w) R`` with Levenberg-Marquardt damping where a step would decrease f.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.kernels.jit import allocating_kernel

STEPS, SMALL = 30, 1e-4
"""[-, rad] Largest number of steps of a climb; length of a step below which it ends."""


@allocating_kernel
def climb_to_mode(information, score, R, H):
    """Move R uphill to a mode; return f there.

    Args:
        information: Information matrix, (9, 9), symmetric.
        score: Score, (9).
        R: Orthogonal matrix, (3, 3), written.
        H: Negative second derivatives of f by w at the mode, (3, 3), written.
    """
    g, w, step = np.zeros(9), np.zeros(3), np.zeros((3, 3))
    value = gain(information, score, R, g)
    damping = 1e-3
    for _ in range(STEPS):
        curvature(information, R, g, w, H)
        tried, length = R.copy(), 0.0
        better = False
        for _ in range(12):
            held = H.copy()
            for a in range(3):
                held[a, a] += damping * (abs(H[0, 0]) + abs(H[1, 1]) + abs(H[2, 2]) + 1e-9)
            positive = inverse(held, step) > 0.0 and held[0, 0] > 0.0
            positive = positive and held[0, 0] * held[1, 1] > held[0, 1] * held[0, 1]
            move = step @ w
            length = math.sqrt(np.sum(move * move))
            if positive and length < 1.0:
                tried[:] = rotation_exp(move) @ R
                new = gain(information, score, tried, g)
                if new >= value:
                    R[:], value, better = tried, new, True
                    damping = max(0.2 * damping, 1e-6)
                    break
            damping *= 5.0
        if not better or length < SMALL:
            break
    gain(information, score, R, g)
    curvature(information, R, g, w, H)
    return value


@allocating_kernel
def gain(information, score, R, g):
    """Return f(R); write its derivatives by the elements of R to g."""
    value = 0.0
    for k in range(9):
        g[k] = score[k]
        for q in range(9):
            g[k] -= information[k, q] * (R[q // 3, q % 3] - (1.0 if q % 4 == 0 else 0.0))
        value += 0.5 * (score[k] + g[k]) * (R[k // 3, k % 3] - (1.0 if k % 4 == 0 else 0.0))
    return value


@allocating_kernel
def curvature(information, R, g, w, H):
    """Write the first derivatives of f by a rotation to w (3), the negative second to H (3, 3)."""
    J = np.zeros((3, 9))
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        for q in range(3):
            J[a, 3 * u + q], J[a, 3 * v + q] = -R[v, q], R[u, q]
    # A rotation by w changes R by [w] R + [w]^2 R / 2, and [w]^2 = w w^T - |w|^2.
    S = g.reshape((3, 3)) @ R.T.copy()
    trace = S[0, 0] + S[1, 1] + S[2, 2]
    w[:] = J @ g
    H[:] = J @ (information @ J.T.copy()) - 0.5 * (S + S.T)
    for a in range(3):
        H[a, a] += trace


@allocating_kernel
def rotation_exp(w):
    """Return the rotation by a vector w [rad], (3, 3), by Rodrigues' formula."""
    angle = math.sqrt(np.sum(w * w))
    first = math.sin(angle) / angle if angle > 1e-9 else 1.0
    second = (1.0 - math.cos(angle)) / (angle * angle) if angle > 1e-9 else 0.5
    R = np.eye(3)
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        R[u, v], R[v, u] = -first * w[a], first * w[a]
    for a in range(3):
        for b in range(3):
            R[a, b] += second * w[a] * w[b]
        R[a, a] -= second * angle * angle
    return R


@allocating_kernel
def inverse(M, out):
    """Write the inverse of a symmetric matrix (3, 3) to out; return that of its determinant."""
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        for b in range(3):
            f, g = (b + 1) % 3, (b + 2) % 3
            out[b, a] = M[u, f] * M[v, g] - M[u, g] * M[v, f]
    scale = 1.0 / (M[0, 0] * out[0, 0] + M[0, 1] * out[1, 0] + M[0, 2] * out[2, 0])
    out *= scale
    return scale


@allocating_kernel
def least_curvature(H):
    """Return the least eigenvalue of a symmetric matrix."""
    return np.linalg.eigvalsh(H)[0]


@allocating_kernel
def is_near(R, other, angle):
    """True if two rotations are less than an angle [rad] from each other."""
    return np.sum(R * other) > 1.0 + 2.0 * math.cos(angle)


@allocating_kernel
def find_modes(information, score, starts, apart):
    """Return all modes that are found from the given starts, and f there, the highest first.

    Args:
        information: Information matrix, (9, 9).
        score: Score, (9).
        starts: Orthogonal matrices, (start, 3, 3).
        apart: Angle below which two modes are one [rad].

    Returns:
        Modes, (mode, 3, 3), and values of f, (mode).
    """
    turns, values = np.zeros(starts.shape), np.full(len(starts), -np.inf)
    H, n = np.zeros((3, 3)), 0
    for k in range(len(starts)):
        R = starts[k].copy()
        value = climb_to_mode(information, score, R, H)
        at = n
        for a in range(n):
            if is_near(turns[a], R, apart):
                at = a
        if at == n:
            n += 1
        if value > values[at]:
            turns[at], values[at] = R, value
    order = np.argsort(-values[:n])
    return turns[order], values[order]
