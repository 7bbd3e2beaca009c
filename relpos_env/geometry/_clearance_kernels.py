"""Clearance of cars: distances between their bodies and the nearest object, compiled.

The distance of two separate rectangles is that of a corner of one from the other. Bodies have
rounded edges, which extend them by their radius.
"""

from __future__ import annotations

import math

from relpos_env.world.pymunk_space import CAR_RADIUS, WALL_RADIUS
from tracking.kernels.jit import kernel, small_kernel

FARTHEST = 0.5
"""[m] Largest clearance."""


@kernel
def read_clearances(body, present, size, room, boxes, out):
    """Write the distance between every car and the nearest wall, box or car.

    Args:
        body: x, y, heading and velocities of cars, (env, car, 6).
        present: Mask of present cars, (env, car).
        size: Half length and width of a car [m], (env, 2).
        room: Half width and depth [m], (env, 2).
        boxes: Centre, half width and depth [m], cosine, sine, (env, box, 6); a half width of 0
            marks an unused row.
        out: Clearances, (env, car) [m], written: 0 at a contact; `FARTHEST` for absent cars.
    """
    for e in range(out.shape[0]):
        half_l, half_w = size[e, 0], size[e, 1]
        reach = math.sqrt(half_l * half_l + half_w * half_w) + FARTHEST
        for n in range(out.shape[1]):
            out[e, n] = FARTHEST
        for n in range(out.shape[1]):
            if not present[e, n]:
                continue
            x, y = body[e, n, 0], body[e, n, 1]
            c, s = math.cos(body[e, n, 2]), math.sin(body[e, n, 2])
            span_x = abs(c) * half_l + abs(s) * half_w
            span_y = abs(s) * half_l + abs(c) * half_w
            to_wall = min(room[e, 0] - abs(x) - span_x, room[e, 1] - abs(y) - span_y)
            near = min(to_wall - CAR_RADIUS - WALL_RADIUS, out[e, n])
            for b in range(boxes.shape[1]):
                if boxes[e, b, 2] == 0.0:
                    continue
                dx, dy = boxes[e, b, 0] - x, boxes[e, b, 1] - y
                far = reach + boxes[e, b, 2] + boxes[e, b, 3]
                if abs(dx) < far and abs(dy) < far:
                    between = gap(
                        dx, dy, c, s, half_l, half_w, boxes[e, b, 4], boxes[e, b, 5],
                        boxes[e, b, 2], boxes[e, b, 3],
                    )  # fmt: skip
                    near = min(near, between - CAR_RADIUS)
            for m in range(n + 1, out.shape[1]):
                if not present[e, m]:
                    continue
                dx, dy = body[e, m, 0] - x, body[e, m, 1] - y
                far = reach + half_l + half_w
                if abs(dx) < far and abs(dy) < far:
                    c_m, s_m = math.cos(body[e, m, 2]), math.sin(body[e, m, 2])
                    between = gap(dx, dy, c, s, half_l, half_w, c_m, s_m, half_l, half_w)
                    between = max(between - 2.0 * CAR_RADIUS, 0.0)
                    near, out[e, m] = min(near, between), min(out[e, m], between)
            out[e, n] = max(near, 0.0)


@small_kernel
def gap(dx, dy, c_a, s_a, half_l_a, half_w_a, c_b, s_b, half_l_b, half_w_b):
    """Return the distance of two rectangles, 0 if a corner of one is in the other [m].

    Args:
        dx: x from the centre of the first to that of the second [m].
        dy: y from the centre of the first to that of the second [m].
        c_a: Cosine of the angle of the first.
        s_a: Sine of the angle of the first.
        half_l_a: Half length of the first [m].
        half_w_a: Half width of the first [m].
        c_b: Cosine of the angle of the second.
        s_b: Sine of the angle of the second.
        half_l_b: Half length of the second [m].
        half_w_b: Half width of the second [m].
    """
    c, s = c_a * c_b + s_a * s_b, c_a * s_b - s_a * c_b
    ahead, left = c_a * dx + s_a * dy, c_a * dy - s_a * dx
    back, right = -(c_b * dx + s_b * dy), -(c_b * dy - s_b * dx)
    return min(
        corner_to_box(ahead, left, c, s, half_l_b, half_w_b, half_l_a, half_w_a),
        corner_to_box(back, right, c, -s, half_l_a, half_w_a, half_l_b, half_w_b),
    )


@small_kernel
def corner_to_box(x, y, c, s, half_l, half_w, box_l, box_w):
    """Return the least distance of a rectangle's corners to an axis-aligned box at the origin [m].

    Args:
        x: x of the centre of the rectangle [m].
        y: y of the centre of the rectangle [m].
        c: Cosine of the angle of the rectangle.
        s: Sine of the angle of the rectangle.
        half_l: Half length of the rectangle [m].
        half_w: Half width of the rectangle [m].
        box_l: Half length of the box [m].
        box_w: Half width of the box [m].
    """
    least = math.inf
    for k in range(4):
        a = half_l if k < 2 else -half_l
        b = half_w if k % 2 == 0 else -half_w
        out_x = max(abs(x + c * a - s * b) - box_l, 0.0)
        out_y = max(abs(y + s * a + c * b) - box_w, 0.0)
        least = min(least, out_x * out_x + out_y * out_y)
    return math.sqrt(least)
