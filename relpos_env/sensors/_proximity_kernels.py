"""What the distance sensors of all cars read: the formulas of `relpos_env.sensors.proximity`."""

from __future__ import annotations

import math

import numpy as np

from relpos_env.sensors.radio._normal_kernels import normal
from relpos_env.sensors.radio._random_kernels import draw_key
from tracking.kernels.jit import kernel, small_kernel


@kernel
def read_proximity(p, seeds, tick, directions, body, present, size, room, boxes, out):
    """One reading of every beam.

    Args:
        p: PROXIMITY, (env).
        seeds: uint64, (env).
        tick: Counts the readings, (env).
        directions: Of beams in the frame of their car, (beam, 2).
        body: x, y, heading and velocities of cars, (env, car, 6).
        present: (env, car)
        size: Half length and width of a car [m], (env, 2).
        room: Half width and depth [m], (env, 2).
        boxes: Centre, half width and depth [m], cosine, sine, (env, box, 6); zero half width for
            none.
        out: Distances, (env, car, beam) [m], written; 0 of absent cars.
    """
    for e in range(out.shape[0]):
        for n in range(out.shape[1]):
            if not present[e, n]:
                for b in range(out.shape[2]):
                    out[e, n, b] = 0.0
                continue
            key = draw_key(seeds[e], np.uint64(tick[e] * 64 + n))
            c, s = math.cos(body[e, n, 2]), math.sin(body[e, n, 2])
            for b in range(out.shape[2]):
                dx, dy = directions[b, 0], directions[b, 1]
                start = min(
                    size[e, 0] / max(abs(dx), 1e-12), size[e, 1] / max(abs(dy), 1e-12)
                )  # fmt: skip
                ux, uy = c * dx - s * dy, s * dx + c * dy
                x, y = body[e, n, 0] + start * ux, body[e, n, 1] + start * uy
                near = nearest(
                    x, y, ux, uy, p[e].cone_cos, p[e].cone_sin, p[e].max_range, body, present,
                    size, room, boxes, e, n,
                )  # fmt: skip
                if near < p[e].max_range:
                    near += (p[e].noise_std + p[e].noise_share * near) * normal(key, b)
                    near = min(max(near, 0.0), p[e].max_range)
                out[e, n, b] = near


@small_kernel
def nearest(x, y, ux, uy, cone_cos, cone_sin, most, body, present, size, room, boxes, e, n):
    """Distance from a point to what is nearest in a cone, or `most` [m].

    Args:
        x: Tip of the cone [m].
        y: Tip of the cone [m], along y.
        ux: Its axis, of length 1.
        uy: Its axis, of length 1, along y.
        cone_cos: Cosine of half its angle.
        cone_sin: Sine of it.
        most: [m]
        body: As for `read_proximity`; likewise the others.
        present: Which cars there are.
        size: Of cars.
        room: Half sides.
        boxes: What stands in it.
        e: Environment.
        n: Whose beam; it does not see itself.
    """
    best = to_wall(room[e, 0] - x, ux, cone_cos, cone_sin, most)
    best = to_wall(room[e, 0] + x, -ux, cone_cos, cone_sin, best)
    best = to_wall(room[e, 1] - y, uy, cone_cos, cone_sin, best)
    best = to_wall(room[e, 1] + y, -uy, cone_cos, cone_sin, best)
    for k in range(boxes.shape[1]):
        if boxes[e, k, 2] > 0.0:
            best = to_box(
                x - boxes[e, k, 0], y - boxes[e, k, 1], ux, uy, boxes[e, k, 4], boxes[e, k, 5],
                boxes[e, k, 2], boxes[e, k, 3], cone_cos, cone_sin, best,
            )  # fmt: skip
    for m in range(body.shape[1]):
        if m == n or not present[e, m]:
            continue
        dx, dy = x - body[e, m, 0], y - body[e, m, 1]
        # The cosine is only worth its time for who is in reach.
        if abs(dx) + abs(dy) < 1.5 * best + 2.0 * (size[e, 0] + size[e, 1]):
            c, s = math.cos(body[e, m, 2]), math.sin(body[e, m, 2])
            best = to_box(
                dx, dy, ux, uy, c, s, size[e, 0], size[e, 1], cone_cos, cone_sin, best
            )  # fmt: skip
    return best


@small_kernel
def to_wall(away, straight, cone_cos, cone_sin, best):
    """Distance in a cone to a wall, if less than the best so far [m].

    Args:
        away: Of the tip from the wall, less than 0 behind it [m].
        straight: Cosine of the angle between axis and normal of the wall.
        cone_cos: Of half the angle of the cone.
        cone_sin: Sine of it.
        best: [m]
    """
    if away <= 0.0:
        return 0.0
    if away >= best:
        return best
    if straight >= cone_cos:
        return away
    # The side of the cone that looks most straight at it.
    steepest = straight * cone_cos + math.sqrt(max(1.0 - straight * straight, 0.0)) * cone_sin
    return min(away / steepest, best) if steepest > 1e-12 else best


@small_kernel
def to_box(x, y, ux, uy, c, s, half_l, half_w, cone_cos, cone_sin, best):
    """Distance in a cone to a box, if less than the best so far [m].

    The nearest point of the box counts if it is in the cone; else the nearest that is in it is on
    one of the cone's sides, since the box is convex.

    Args:
        x: Tip, from the centre of the box [m].
        y: Tip, from the centre of the box [m], along y.
        ux: Axis, of length 1.
        uy: Axis, of length 1, along y.
        c: Cosine of the angle of the box.
        s: Sine of it.
        half_l: Half sides [m].
        half_w: Half sides [m].
        cone_cos: Of half the angle of the cone.
        cone_sin: Sine of it.
        best: [m]
    """
    x, y, ux, uy = c * x + s * y, c * y - s * x, c * ux + s * uy, c * uy - s * ux
    to_x, to_y = min(max(x, -half_l), half_l) - x, min(max(y, -half_w), half_w) - y
    distance = math.sqrt(to_x * to_x + to_y * to_y)
    if distance >= best or distance == 0.0:
        return min(distance, best)
    if to_x * ux + to_y * uy >= cone_cos * distance:
        return distance
    left = along_ray(
        x, y, cone_cos * ux - cone_sin * uy, cone_cos * uy + cone_sin * ux, half_l, half_w
    )
    right = along_ray(
        x, y, cone_cos * ux + cone_sin * uy, cone_cos * uy - cone_sin * ux, half_l, half_w
    )
    return min(left, right, best)


@small_kernel
def along_ray(x, y, ux, uy, half_l, half_w):
    """Way along a ray to a box that is turned as the axes are; infinite if it misses [m]."""
    low, high = 0.0, math.inf
    for axis in range(2):
        start, step, half = (x, ux, half_l) if axis == 0 else (y, uy, half_w)
        if abs(step) < 1e-12:
            if abs(start) > half:
                return math.inf
            continue
        first, last = (-half - start) / step, (half - start) / step
        low, high = max(low, min(first, last)), min(high, max(first, last))
    return low if low <= high else math.inf
