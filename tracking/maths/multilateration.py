"""Where a node is, by its distances to others that are known: the place that fits best.

Least squares of squared distances need no first guess (`first_ranges.place_across`), but are far
off where the others are nearly in line, or close together; from there, with each of their axes left
open in turn, the distances themselves are fitted. Obstacles only lengthen ranges, so a distance
that is too short says more than one that is too long, and none more than a little.
"""

from __future__ import annotations

import numpy as np

from tracking.jit import allocating_kernel, kernel, small_kernel
from tracking.maths.linear_multilateration import main_axes, place_across, sort_sides

JOIN_SPREAD = 0.75
"""[m] Others that extend less than this along an axis leave the side of a node open: along it, an
error of a range counts several times."""
WORSE = 9.0
"""[-] A second side that the distances say so much more against is none: three standard deviations
of a single one."""
EQUAL, ON_EDGE = 1e-6, 1e-9
"""[-, m2] Less than this is rounding: of what distances say, and of on which side a place is."""
SHORT, LONG = 0.12, 0.3
"""[m] Scales of ranges shorter and longer than they should be."""
MOST = 16.0
"""[-] A single range says no more than this, as a squared error in these scales."""
FAR_OFF = 0.01
"""[-] How much a distance pulls that is as far off as can be."""
STEPS = 10
"""[-] Of Gauss and Newton from a first place to the one that fits best."""


@small_kernel
def misfit(error):
    """What an error [m] says against a place."""
    scaled = error / (LONG if error > 0.0 else SHORT)
    return min(scaled * scaled, MOST)


@kernel
def total_loss(known, distance, pos):
    """What distances (other) to known places say against a position."""
    total = 0.0
    for a in range(known.shape[0]):
        squared = 0.0
        for k in range(3):
            squared += (known[a, k] - pos[k]) ** 2
        total += misfit(distance[a] - np.sqrt(squared))
    return total


@allocating_kernel
def best_position(d, known, distance, pos):
    """Replace a position by the one that the distances say least against; returns what they say.

    Looked for from where least squares put it, on both sides of the others along each of their
    axes, from where it is, and from the mirror image of that.
    """
    first = np.zeros((2 * d + 4, 3))
    initial_positions(d, known, distance, first[: 2 * d + 2])
    first[2 * d + 2] = reflected_position(d, known, pos)
    first[2 * d + 3] = pos
    least = np.inf
    for a in range(first.shape[0]):
        total = refine(d, known, distance, first[a])
        if total < least:
            least = total
            pos[:] = first[a]
    return least


@allocating_kernel
def best_positions(d, merge_distance, known, distance, sides):
    """The place that distances say least against, and a second if they leave the side open.

    Args:
        d: 2 or 3.
        merge_distance: Places that are nearer to each other are one [m].
        known: Positions of others, (other, 3) [m].
        distance: Distances to them, (other) [m].
        sides: Places, the better one first, (2, 3), written.

    Returns:
        How many places there are, 1 or 2.
    """
    places = np.zeros((2 * d + 2, 3))
    initial_positions(d, known, distance, places)
    said = np.empty(len(places))
    for a in range(len(places)):
        said[a] = refine(d, known, distance, places[a])
    order = np.argsort(said)
    sides[0] = sides[1] = places[order[0]]
    centre, _, extent, axes = main_axes(d, known)
    if extent[d - 1] > JOIN_SPREAD:
        return 1
    across = axes[d - 1].copy()
    side = np.sum((sides[0, :d] - centre) * across)
    for a in order[1:]:
        relative_covariance = np.sum((places[a] - sides[0]) ** 2) >= merge_distance**2
        beyond = np.sum((places[a, :d] - centre) * across) * side < -ON_EDGE
        if relative_covariance and beyond and said[a] < said[order[0]] + WORSE:
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
def refine(d, known, distance, pos):
    """Move a position to where the distances fit best; returns what they say against that.

    Distances that are far off hardly pull. A step may lead away: the best place passed counts.
    """
    best, least = pos.copy(), total_loss(known, distance, pos)
    for _ in range(STEPS):
        N, g = 1e-6 * np.eye(d), np.zeros(d)
        for a in range(known.shape[0]):
            off = pos[:d] - known[a, :d]
            way = max(np.sqrt(np.sum(off * off)), 1e-6)
            error = distance[a] - way
            scale = LONG if error > 0.0 else SHORT
            weight = 1.0 / (scale * scale)
            if misfit(error) >= MOST:
                weight *= FAR_OFF
            for k in range(d):
                g[k] += weight * error * off[k] / way
                for q in range(d):
                    N[k, q] += weight * off[k] * off[q] / (way * way)
        pos[:d] += np.linalg.solve(N, g)
        total = total_loss(known, distance, pos)
        if total < least:
            least = total
            best[:] = pos
    pos[:] = best
    return least
