"""Compiled shortest paths round boxes, and the progress of cars along them.

A shortest path round boxes bends at their corners only, so it is a path in the visibility graph of
the corners [1]. Corners are offset from the boxes by the space that a car needs.

References:
    [1] Lozano-Perez and Wesley, Commun. ACM 22(10) (1979), 560-570.
"""

from __future__ import annotations

import math

from relpos_env.sensors.radio._occlusion_kernels import crosses_box
from tracking.kernels.jit import kernel, small_kernel

BERTH = 0.12
"""[m] Minimum distance of paths from boxes and walls along their sides: a little more than half
the width of a car. Cars may come nearer."""
CORNER = 0.13
"""[m] Offset of path corners from the boxes along both sides. Little more than `BERTH`, so that the
path length hardly jumps when the goal becomes visible past a corner."""
HAIR = 1e-9
"""[m] Tolerance that keeps a line that starts at the permitted distance from crossing the box."""


@small_kernel
def crosses(x_a, y_a, x_b, y_b, boxes):
    """True if the line from a to b comes nearer to a box than `BERTH` and than both a and b."""
    for k in range(boxes.shape[0]):
        if boxes[k, 2] == 0.0:
            continue
        # A car close to a box may leave it: the berth shrinks to the distance of the car.
        berth = min(gap(x_a, y_a, boxes[k]), gap(x_b, y_b, boxes[k]), BERTH)
        if crosses_box(x_a, y_a, x_b, y_b, boxes[k], max(berth, 0.0) - HAIR):
            return True
    return False


@small_kernel
def gap(x, y, box):
    """Return the signed Chebyshev distance of a point from a box, in the box's axes [m]."""
    d_x, d_y, c, s = x - box[0], y - box[1], box[4], box[5]
    return max(abs(c * d_x + s * d_y) - box[2], abs(c * d_y - s * d_x) - box[3])


@kernel
def lay_ways(boxes, half_x, half_y, corner, between):
    """Compute the reachable corners and the shortest paths between them.

    Args:
        boxes: Centre, half width and depth [m], cosine, sine, (box, 6).
        half_x: Half width of the room [m].
        half_y: Half depth of the room [m].
        corner: Corners, (corner, 2) [m], written.
        between: Path lengths, (corner, corner) [m], written; infinite where there is no path.

    Returns:
        Number of corners.
    """
    n = 0
    for k in range(boxes.shape[0]):
        if boxes[k, 2] == 0.0:
            continue
        for side in range(4):
            u = (boxes[k, 2] + CORNER) * (1.0 if side < 2 else -1.0)
            v = (boxes[k, 3] + CORNER) * (1.0 if side % 2 == 0 else -1.0)
            x = boxes[k, 0] + boxes[k, 4] * u - boxes[k, 5] * v
            y = boxes[k, 1] + boxes[k, 5] * u + boxes[k, 4] * v
            if abs(x) > half_x - BERTH or abs(y) > half_y - BERTH or is_taken(x, y, boxes):
                continue
            corner[n, 0], corner[n, 1] = x, y
            n += 1
    for i in range(n):
        between[i, i] = 0.0
        for j in range(i):
            x_i, y_i, x_j, y_j = corner[i, 0], corner[i, 1], corner[j, 0], corner[j, 1]
            seen = not crosses(x_i, y_i, x_j, y_j, boxes)
            between[i, j] = math.hypot(x_i - x_j, y_i - y_j) if seen else math.inf
            between[j, i] = between[i, j]
    for k in range(n):
        for i in range(n):
            for j in range(n):
                between[i, j] = min(between[i, j], between[i, k] + between[k, j])
    return n


@small_kernel
def is_taken(x, y, boxes):
    """True if the distance of a point from a box, see `gap`, is less than `BERTH`."""
    n_near = 0
    for k in range(boxes.shape[0]):
        n_near += boxes[k, 2] > 0.0 and gap(x, y, boxes[k]) < BERTH
    return n_near > 0


@kernel
def follow_ways(start, stop, pos, present, goal, boxes, graph, memory, progress):
    """Compute the decrease of every car's shortest path to its goal.

    Args:
        start: First environment.
        stop: One past the last environment.
        pos: Positions, (env, car, 2) [m].
        present: True where the car is present, (env, car).
        goal: Goal positions, (env, car, 2) [m].
        boxes: Boxes as in `lay_ways`, (env, box, 6).
        graph: Number of corners, (env); corners, (env, corner, 2) [m]; path lengths between
            them, (env, corner, corner) [m].
        memory: Previous goals, (env, car, 2) [m], NaN for none; path lengths to them from each
            corner, (env, car, corner) [m], and from the car, (env, car) [m]; updated.
        progress: Progress, (env, car) [m], written; 0 if the goal is new or unreachable.
    """
    n_corners, corner, between = graph
    before, onward, last = memory
    for e in range(start, stop):
        here, n = boxes[e], n_corners[e]
        for k in range(pos.shape[1]):
            progress[e, k] = 0.0
            if not present[e, k]:
                before[e, k, 0] = math.nan
                continue
            x, y, to_x, to_y = pos[e, k, 0], pos[e, k, 1], goal[e, k, 0], goal[e, k, 1]
            is_new = before[e, k, 0] != to_x or before[e, k, 1] != to_y
            if is_new:
                before[e, k, 0], before[e, k, 1] = to_x, to_y
                ways_to(to_x, to_y, here, n, corner[e], between[e], onward[e, k])
            way = math.inf
            if not crosses(x, y, to_x, to_y, here):
                way = math.hypot(to_x - x, to_y - y)
            else:
                for j in range(n):
                    u, v = corner[e, j, 0], corner[e, j, 1]
                    whole = math.hypot(u - x, v - y) + onward[e, k, j]
                    if whole < way and not crosses(x, y, u, v, here):
                        way = whole
            if way == math.inf:
                # Without a path the last length is kept; a new goal without one stays new.
                if is_new:
                    before[e, k, 0] = math.nan
                continue
            if not is_new:
                progress[e, k] = last[e, k] - way
            last[e, k] = way


@small_kernel
def ways_to(x, y, boxes, n, corner, between, onward):
    """Write the shortest path lengths from n corners to a point into onward (corner) [m]."""
    for i in range(n):
        onward[i] = math.inf
    for j in range(n):
        if not crosses(corner[j, 0], corner[j, 1], x, y, boxes):
            segment = math.hypot(x - corner[j, 0], y - corner[j, 1])
            for i in range(n):
                onward[i] = min(onward[i], between[i, j] + segment)
