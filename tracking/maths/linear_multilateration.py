"""A position from distances by linear equations, on both sides of those that are flat."""

from __future__ import annotations

import numpy as np

from tracking.kernels.jit import allocating_kernel

MIN_EXTENT = 0.1
"""[m] Along an axis of which others extend less, the errors of ranges are all that they tell."""


@allocating_kernel
def place(d, min_spread, merge_distance, known, distance, sides):
    """Where a node is, from its distances to known ones; both candidates if a mirror fits too.

    Args:
        d: 2 or 3.
        min_spread: A layout with less extent along an axis does not span it [m].
        merge_distance: A node nearer than this to the plane of the others has no other side [m].
        known: Positions, (known, 3) [m].
        distance: Distances to them, (known) [m].
        sides: The candidates, (2, 3), written.

    Returns:
        1 if the known nodes span the space, 2 if they are too flat to tell the side.
    """
    _, _, extent, _ = main_axes(d, known)
    flat = extent[d - 1] <= min_spread
    height = place_across(d, known, distance, d - 1 if flat else d, sides)
    sort_sides(d, known, sides)
    return 2 if flat and height >= merge_distance else 1


@allocating_kernel
def sort_sides(d, known, sides):
    """Put two places that are equally good into an order that no numbering nor rotation changes.

    By the sign of the volume of what the others lean to, where between the places they are, and
    the way from one to the other.
    """
    centre, leaning = np.zeros(d), np.zeros(d)
    for a in range(known.shape[0]):
        centre += known[a, :d] / known.shape[0]
    for a in range(known.shape[0]):
        out = known[a, :d] - centre
        leaning += np.sum(out * out) * out
    between, way = 0.5 * (sides[0, :d] + sides[1, :d]) - centre, sides[0, :d] - sides[1, :d]
    if d == 2:
        volume = between[0] * way[1] - between[1] * way[0]
    else:
        volume = 0.0
        for k in range(3):
            u, v = (k + 1) % 3, (k + 2) % 3
            volume += way[k] * (leaning[u] * between[v] - leaning[v] * between[u])
    if volume < 0.0:
        for k in range(3):
            sides[0, k], sides[1, k] = sides[1, k], sides[0, k]


@allocating_kernel
def main_axes(d, known):
    """Centre of positions, what they are from it, extent along their main axes, and the axes.

    Extents are root mean squares [m], the longest first; axes are rows.
    """
    centre = np.zeros(d)
    for a in range(known.shape[0]):
        centre += known[a, :d] / known.shape[0]
    A = known[:, :d].copy() - centre
    _, S, axes = np.linalg.svd(A.T.copy() @ A)
    return centre, A, np.sqrt(S / known.shape[0]), axes


@allocating_kernel
def place_across(d, known, distance, axis, sides):
    """Where a node is by least squares of squared distances, with one axis of the others left open.

    On both sides along it, so far away that the distances are right in the mean.

    Args:
        d: 2 or 3.
        known: Positions, (known, 3) [m].
        distance: Distances to them, (known) [m].
        axis: Which of their main axes is open, the longest first; d for none. Others along which
            they hardly extend say nothing either.
        sides: The places, (2, 3), written.

    Returns:
        How far from the others the places are along that axis [m].
    """
    m = known.shape[0]
    centre, A, extent, axes = main_axes(d, known)
    # |p|^2 - 2 a.p + |a|^2 = d^2: its differences from the mean are linear in p.
    b = np.zeros(m)
    for a in range(m):
        b[a] = 0.5 * (np.sum(A[a] * A[a]) - distance[a] ** 2)
    b -= np.mean(b)
    p = np.zeros(d)
    for k in range(d):
        if k != axis and extent[k] > MIN_EXTENT:
            along = axes[k].copy()
            p += along * (np.sum((A @ along) * b) / (m * extent[k] ** 2))
    height2 = 0.0
    for a in range(m):
        height2 += (distance[a] ** 2 - np.sum((p - A[a]) ** 2)) / m
    height = np.sqrt(max(height2, 0.0)) if axis < d else 0.0
    sides[:, :] = 0.0
    for side in range(2):
        up = height if side == 0 else -height
        for k in range(d):
            sides[side, k] = centre[k] + p[k]
            if axis < d:
                sides[side, k] += up * axes[axis, k]
    return height
