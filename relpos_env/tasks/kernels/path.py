"""Ways round what stands in a room, and how far cars come along them, compiled.

A shortest way round boxes bends at their corners only, so it is one through the graph of the
corners that see each other [1]; here corners stand out by what a car needs to drive round them.

References:
    [1] Lozano-Perez and Wesley, Commun. ACM 22(10) (1979), 560-570.
"""

from __future__ import annotations

import math

from relpos_env.sensors.radio._occlusion_kernels import crosses_box
from tracking.kernels.jit import kernel, small_kernel

BERTH = 0.12
"""[m] A way comes no nearer to a box or a wall, along their sides: half the width of a car, and a
little. Cars may."""
CORNER = 0.13
"""[m] Corners of boxes are passed so far out, along both sides: hardly further, so that a way does
not become another where it is seen past a corner."""
HAIR = 1e-9
"""[m] Who stands as near to a box as a line may pass does not cross it."""


@small_kernel
def crosses(x_a, y_a, x_b, y_b, boxes):
    """True if the line from a to b comes nearer than `BERTH` to a box, or than a or b is to it."""
    for k in range(boxes.shape[0]):
        if boxes[k, 2] == 0.0:
            continue
        # Who stands at a box may leave it: with a smaller berth there, not all at once with none.
        berth = min(gap(x_a, y_a, boxes[k]), gap(x_b, y_b, boxes[k]), BERTH)
        if crosses_box(x_a, y_a, x_b, y_b, boxes[k], max(berth, 0.0) - HAIR):
            return True
    return False


@small_kernel
def gap(x, y, box):
    """How far a point is from a box, along that of its sides where it is further [m]."""
    d_x, d_y, c, s = x - box[0], y - box[1], box[4], box[5]
    return max(abs(c * d_x + s * d_y) - box[2], abs(c * d_y - s * d_x) - box[3])


@kernel
def lay_ways(boxes, half_x, half_y, corner, between):
    """Corners at which a car can be, and the shortest ways between them.

    Args:
        boxes: Centre, half width and depth [m], cosine, sine, (box, 6).
        half_x: Half the width of the room [m].
        half_y: Half its depth [m].
        corner: (corner, 2) [m], written.
        between: (corner, corner) [m], written; infinite where there is no way.

    Returns:
        How many corners there are.
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
    """True if a point is nearer than `BERTH` to a box, along its sides."""
    n_near = 0
    for k in range(boxes.shape[0]):
        n_near += boxes[k, 2] > 0.0 and gap(x, y, boxes[k]) < BERTH
    return n_near > 0


@kernel
def follow_ways(start, stop, pos, present, goal, boxes, graph, memory, progress):
    """How much nearer every car has come to its goal, along the shortest way there.

    Args:
        start: First environment.
        stop: One behind the last.
        pos: (env, car, 2) [m].
        present: (env, car).
        goal: (env, car, 2) [m].
        boxes: (env, box, 6).
        graph: How many corners, (env); corners, (env, corner, 2) [m]; ways between them,
            (env, corner, corner) [m].
        memory: Goals before, (env, car, 2) [m], NaN for none; ways to them from each corner,
            (env, car, corner) [m], and from the car, (env, car) [m]; updated.
        progress: (env, car) [m], written; 0 of a car whose goal is new or cannot be reached.
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
                # From a niche that no way leads out of it is as far as it was before; a car that
                # begins in one has no way yet.
                if is_new:
                    before[e, k, 0] = math.nan
                continue
            if not is_new:
                progress[e, k] = last[e, k] - way
            last[e, k] = way


@small_kernel
def ways_to(x, y, boxes, n, corner, between, onward):
    """Shortest ways from each of n corners to a point, into onward (corner) [m]."""
    for i in range(n):
        onward[i] = math.inf
    for j in range(n):
        if not crosses(corner[j, 0], corner[j, 1], x, y, boxes):
            leg = math.hypot(x - corner[j, 0], y - corner[j, 1])
            for i in range(n):
                onward[i] = min(onward[i], between[i, j] + leg)
