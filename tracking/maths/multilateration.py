"""Robust multilateration: the position of a node that best fits its distances to known nodes.

Least squares of squared distances (`linear_multilateration.place_across`) need no initial guess,
but err by much if the known nodes are nearly collinear or close together. With each main axis left
out in turn they give initial positions for a fit of the distances. Obstacles only lengthen ranges,
so a distance that is too short has a larger loss than one that is too long; losses are bounded.
Their scales are fields of `c` (`JointStartParams`).
"""

from __future__ import annotations

import numpy as np

from tracking.kernels.jit import allocating_kernel, kernel, small_kernel
from tracking.maths.linear_multilateration import main_axes, place_across, sort_sides

EQUAL, ON_EDGE = 1e-6, 1e-9
"""[-, m2] Rounding error of a loss, and of the product of two offsets that decides the side."""
STEPS = 10
"""[-] Number of Gauss-Newton steps from each initial position."""


@small_kernel
def misfit(c, error):
    """Return the bounded squared loss of the error of a distance [m]."""
    scaled = error / (c.long_error if error > 0.0 else c.short_error)
    return min(scaled * scaled, c.largest_loss)


@kernel
def total_loss(c, known, distance, pos):
    """Return the total loss of a position over the distances to known positions, (other)."""
    total = 0.0
    for a in range(known.shape[0]):
        squared = 0.0
        for k in range(3):
            squared += (known[a, k] - pos[k]) ** 2
        total += misfit(c, distance[a] - np.sqrt(squared))
    return total


@allocating_kernel
def best_position(c, known, distance, pos):
    """Replace a position by the one with the least total loss; return this loss.

    The search starts from the least squares solutions on both sides along each main axis of the
    others, from the given position, and from its mirror image.
    """
    d = c.d
    first = np.zeros((2 * d + 4, 3))
    initial_positions(d, known, distance, first[: 2 * d + 2])
    first[2 * d + 2] = reflected_position(d, known, pos)
    first[2 * d + 3] = pos
    least = np.inf
    for a in range(first.shape[0]):
        total = refine(c, known, distance, first[a])
        if total < least:
            least = total
            pos[:] = first[a]
    return least


@allocating_kernel
def best_positions(c, known, distance, sides):
    """Write the position with the least total loss, and a second one if the side is ambiguous.

    Args:
        c: Coefficients.
        known: Positions of others, (other, 3) [m].
        distance: Distances to them, (other) [m].
        sides: Positions, the better one first, (2, 3), written.

    Returns:
        Number of positions, 1 or 2.
    """
    d = c.d
    places = np.zeros((2 * d + 2, 3))
    initial_positions(d, known, distance, places)
    said = np.empty(len(places))
    for a in range(len(places)):
        said[a] = refine(c, known, distance, places[a])
    order = np.argsort(said)
    sides[0] = sides[1] = places[order[0]]
    centre, _, extent, axes = main_axes(d, known)
    if extent[d - 1] > c.join_spread:
        return 1
    across = axes[d - 1].copy()
    side = np.sum((sides[0, :d] - centre) * across)
    for a in order[1:]:
        is_apart = np.sum((places[a] - sides[0]) ** 2) >= c.merge_distance**2
        beyond = np.sum((places[a, :d] - centre) * across) * side < -ON_EDGE
        if is_apart and beyond and said[a] < said[order[0]] + c.second_side_loss:
            sides[1] = places[a]
            if said[a] < said[order[0]] + EQUAL:
                sort_sides(d, known, sides)
            return 2
    return 1


@allocating_kernel
def initial_positions(d, known, distance, places):
    """Write the least squares positions of a node with each main axis left out, and with none.

    Args:
        d: 2 or 3.
        known: Positions of others, (other, 3) [m].
        distance: Distances to them, (other) [m].
        places: (2 d + 2, 3) [m], written.
    """
    for axis in range(d + 1):
        place_across(d, known, distance, axis, places[2 * axis : 2 * axis + 2])


@allocating_kernel
def reflected_position(d, known, pos):
    """Reflect a position across the line or plane that fits the known positions best."""
    centre = np.zeros(3)
    for a in range(known.shape[0]):
        centre += known[a] / known.shape[0]
    out = known - centre
    _, E = np.linalg.eigh(out[:, :d].T.copy() @ out[:, :d].copy())
    image = pos.copy()
    off = 0.0
    for k in range(d):
        off += E[k, 0] * (pos[k] - centre[k])
    for k in range(d):
        image[k] -= 2.0 * off * E[k, 0]
    return image


@allocating_kernel
def refine(c, known, distance, pos):
    """Move a position to the least loss by Gauss-Newton steps; return the total loss there.

    Distances of the largest loss have a small weight. A step may fail: the best position is kept.
    """
    d = c.d
    best, least = pos.copy(), total_loss(c, known, distance, pos)
    for _ in range(STEPS):
        N, g = 1e-6 * np.eye(d), np.zeros(d)
        for a in range(known.shape[0]):
            off = pos[:d] - known[a, :d]
            way = max(np.sqrt(np.sum(off * off)), 1e-6)
            error = distance[a] - way
            scale = c.long_error if error > 0.0 else c.short_error
            weight = 1.0 / (scale * scale)
            if misfit(c, error) >= c.largest_loss:
                weight *= c.far_weight
            for k in range(d):
                g[k] += weight * error * off[k] / way
                for q in range(d):
                    N[k, q] += weight * off[k] * off[q] / (way * way)
        pos[:d] += np.linalg.solve(N, g)
        total = total_loss(c, known, distance, pos)
        if total < least:
            least = total
            best[:] = pos
    pos[:] = best
    return least
