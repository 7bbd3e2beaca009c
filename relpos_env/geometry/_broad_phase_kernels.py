"""Broad phase: tests for imminent contacts, since only these need the rigid-body solver.

Bodies without contacts move by their forces alone. `relpos_env.world._car_kernels` uses the
formulas of the solver for these, so the result without the solver is equal, bit for bit.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel

MARGIN = 0.10
"""[m] More than the approach of two bodies within a step plus their rounded corners."""


@small_kernel
def touches_soon(body, present, box_body, boxes, room, size, e):
    """Return whether a present car is close to a wall, a box or another car, or a box moves.

    Args:
        body: x, y, heading and velocities of cars, (env, car, 6).
        present: Mask of present cars, (env, car).
        box_body: x, y, angle and velocities of boxes, (env, box, 6).
        boxes: Centre, half width and depth [m], cosine, sine, (env, box, 6).
        room: Half width and depth [m], (env, 2).
        size: Half length and width of a car [m], (env, 2).
        e: Index of the environment.
    """
    for b in range(box_body.shape[1]):
        if box_body[e, b, 3] != 0.0 or box_body[e, b, 4] != 0.0 or box_body[e, b, 5] != 0.0:
            return True
    half_l, half_w = size[e, 0], size[e, 1]
    for n in range(body.shape[1]):
        if not present[e, n] or is_far(body, present, boxes, room, half_l + half_w, e, n):
            continue
        x, y = body[e, n, 0], body[e, n, 1]
        c, s = math.cos(body[e, n, 2]), math.sin(body[e, n, 2])
        out_x = abs(c) * half_l + abs(s) * half_w + MARGIN
        out_y = abs(s) * half_l + abs(c) * half_w + MARGIN
        if abs(x) + out_x > room[e, 0] or abs(y) + out_y > room[e, 1]:
            return True
        for b in range(boxes.shape[1]):
            if boxes[e, b, 2] == 0.0:
                continue
            cb, sb = boxes[e, b, 4], boxes[e, b, 5]
            dx, dy = x - boxes[e, b, 0], y - boxes[e, b, 1]
            along, across = cb * dx + sb * dy, cb * dy - sb * dx
            cr, sr = c * cb + s * sb, s * cb - c * sb
            if (
                abs(along) < boxes[e, b, 2] + abs(cr) * half_l + abs(sr) * half_w + MARGIN
                and abs(across) < boxes[e, b, 3] + abs(sr) * half_l + abs(cr) * half_w + MARGIN
            ):
                return True
        for m in range(n + 1, body.shape[1]):
            if not present[e, m]:
                continue
            dx, dy = body[e, m, 0] - x, body[e, m, 1] - y
            reach = 2.0 * (half_l + half_w) + MARGIN
            if abs(dx) > reach or abs(dy) > reach:
                continue
            cm, sm = math.cos(body[e, m, 2]), math.sin(body[e, m, 2])
            cr, sr = c * cm + s * sm, s * cm - c * sm
            along, across = c * dx + s * dy, c * dy - s * dx
            if (
                abs(along) < half_l + abs(cr) * half_l + abs(sr) * half_w + MARGIN
                and abs(across) < half_w + abs(sr) * half_l + abs(cr) * half_w + MARGIN
            ):
                return True
    return False


@small_kernel
def is_far(body, present, boxes, room, reach, e, n):
    """Return whether a car is far from all objects at any heading; `reach` > half a car [m]."""
    x, y, far = body[e, n, 0], body[e, n, 1], reach + MARGIN
    if abs(x) + far > room[e, 0] or abs(y) + far > room[e, 1]:
        return False
    for b in range(boxes.shape[1]):
        if boxes[e, b, 2] == 0.0:
            continue
        corner = boxes[e, b, 2] + boxes[e, b, 3]
        if abs(x - boxes[e, b, 0]) < corner + far and abs(y - boxes[e, b, 1]) < corner + far:
            return False
    for m in range(n + 1, body.shape[1]):
        if (
            present[e, m]
            and abs(body[e, m, 0] - x) < far + reach
            and abs(body[e, m, 1] - y) < far + reach
        ):
            return False
    return True
