"""Where a node is, by its distances to others that are known: the place that fits best.

Least squares of squared distances need no first guess (`first_ranges.place_across`), but are far
off where the others are nearly in line, or close together; from there, with each of their axes left
open in turn, the distances themselves are fitted. Obstacles only lengthen ranges, so a distance
that is too short says more than one that is too long, and none more than a little. The scales of
that are fields of `c` (`JointStartParams`).
"""

from __future__ import annotations

import numpy as np

from tracking.kernels.jit import allocating_kernel, kernel, small_kernel
from tracking.maths.linear_multilateration import main_axes, place_across, sort_sides

EQUAL, ON_EDGE = 1e-6, 1e-9
"""[-, m2] Less than this is rounding: of what distances say, and of on which side a place is."""
STEPS = 10
"""[-] Of Gauss and Newton from a first place to the one that fits best."""


@small_kernel
def misfit(c, error):
    """What an error [m] says against a place."""
    scaled = error / (c.long_error if error > 0.0 else c.short_error)
    return min(scaled * scaled, c.largest_loss)


@kernel
def total_loss(c, known, distance, pos):
    """What distances (other) to known places say against a position."""
    total = 0.0
    for a in range(known.shape[0]):
        squared = 0.0
        for k in range(3):
            squared += (known[a, k] - pos[k]) ** 2
        total += misfit(c, distance[a] - np.sqrt(squared))
    return total


@allocating_kernel
def best_position(c, known, distance, pos):
    """Replace a position by the one that the distances say least against; returns what they say.

    Looked for from where least squares put it, on both sides of the others along each of their
    axes, from where it is, and from the mirror image of that.
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
    """The place that distances say least against, and a second if they leave the side open.

    Args:
        c: Coefficients.
        known: Positions of others, (other, 3) [m].
        distance: Distances to them, (other) [m].
        sides: Places, the better one first, (2, 3), written.

    Returns:
        How many places there are, 1 or 2.
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
    """Where least squares put a node with each axis of the others left open, and with none.

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
    """Of a position across the line, or plane, that known places are nearest to."""
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
    """Move a position to where the distances fit best; returns what they say against that.

    Distances that are far off hardly pull. A step may lead away: the best place passed counts.
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
