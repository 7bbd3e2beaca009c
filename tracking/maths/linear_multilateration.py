"""Linear multilateration: a position from distances, on both sides of a flat layout."""

from __future__ import annotations

import numpy as np

from tracking.kernels.jit import allocating_kernel

MIN_EXTENT = 0.1
"""[m] RMS extent of the known nodes along an axis below which range errors dominate there."""


@allocating_kernel
def place(d, min_spread, merge_distance, known, distance, sides):
    """Write the position of a node from its distances to known ones; two if the side is ambiguous.

    Args:
        d: 2 or 3.
        min_spread: RMS extent along an axis up to which a layout does not span it [m].
        merge_distance: A node nearer than this to the plane of the others has no other side [m].
        known: Positions, (known, 3) [m].
        distance: Distances to them, (known) [m].
        sides: The candidates, (2, 3), written.

    Returns:
        Number of candidates: 2 if the known nodes are too flat to determine the side, else 1.
    """
    _, _, extent, _ = main_axes(d, known)
    flat = extent[d - 1] <= min_spread
    height = place_across(d, known, distance, d - 1 if flat else d, sides)
    sort_sides(d, known, sides)
    return 2 if flat and height >= merge_distance else 1


@allocating_kernel
def sort_sides(d, known, sides):
    """Order two positions that are equally good, independently of numbering and rotation.

    The order is the sign of the cross product of their midpoint, from the centre, and their
    difference; in space, of a triple product with the third moment of the known positions.
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
    """Return the centre, the positions about it, their extents along the main axes, and the axes.

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
    """Write the position by least squares of squared distances, with one main axis left out.

    There is one on both sides along this axis, where the mean of the squared distances fits.

    Args:
        d: 2 or 3.
        known: Positions, (known, 3) [m].
        distance: Distances to them, (known) [m].
        axis: Index of the main axis that is left out, the longest first; d for none. Axes shorter
            than `MIN_EXTENT` are not used either.
        sides: The positions, (2, 3), written.

    Returns:
        Distance of the positions from the centre along that axis [m].
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
