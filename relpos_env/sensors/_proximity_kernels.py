"""Distance sensors of all cars, with the formulas of `relpos_env.sensors.proximity`."""

from __future__ import annotations

import math

import numpy as np

from relpos_env.sensors.radio._normal_kernels import normal
from relpos_env.sensors.radio._random_kernels import draw_key
from tracking.kernels.jit import kernel, small_kernel


@kernel
def read_proximity(p, seeds, tick, directions, body, present, size, room, boxes, out):
    """Write one reading of every distance sensor.

    Args:
        p: PROXIMITY, (env).
        seeds: Seeds of the sensors, uint64, (env).
        tick: Number of the reading, (env).
        directions: Unit vectors of the sensor axes in the frame of the car, (sensor, 2).
        body: x, y, heading and velocities of cars, (env, car, 6).
        present: Mask of present cars, (env, car).
        size: Half length and width of a car [m], (env, 2).
        room: Half width and depth [m], (env, 2).
        boxes: Centre, half width and depth [m], cosine, sine, (env, box, 6); a half width of 0
            marks an unused row.
        out: Distances, (env, car, sensor) [m], written; 0 for absent cars.
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
    """Return the distance from a point to the nearest surface in a cone, at most `most` [m].

    Args:
        x: x of the tip of the cone [m].
        y: y of the tip of the cone [m].
        ux: x of the axis of the cone, of length 1.
        uy: y of the axis of the cone, of length 1.
        cone_cos: Cosine of half the angle of the cone.
        cone_sin: Sine of half the angle of the cone.
        most: Largest distance [m].
        body: As for `read_proximity`.
        present: As for `read_proximity`.
        size: As for `read_proximity` [m].
        room: As for `read_proximity` [m].
        boxes: As for `read_proximity`.
        e: Index of the environment.
        n: Index of the car with the sensor; the sensor does not measure this car.
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
        # Cosine and sine are computed only for cars within reach.
        if abs(dx) + abs(dy) < 1.5 * best + 2.0 * (size[e, 0] + size[e, 1]):
            c, s = math.cos(body[e, m, 2]), math.sin(body[e, m, 2])
            best = to_box(
                dx, dy, ux, uy, c, s, size[e, 0], size[e, 1], cone_cos, cone_sin, best
            )  # fmt: skip
    return best


@small_kernel
def to_wall(away, straight, cone_cos, cone_sin, best):
    """Return the distance in a cone to a wall, at most `best` [m].

    Args:
        away: Distance of the tip from the wall, less than 0 behind it [m].
        straight: Cosine of the angle between axis and normal of the wall.
        cone_cos: Cosine of half the angle of the cone.
        cone_sin: Sine of half the angle of the cone.
        best: Smallest distance found so far [m].
    """
    if away <= 0.0:
        return 0.0
    if away >= best:
        return best
    if straight >= cone_cos:
        return away
    # The edge of the cone nearest to the normal of the wall.
    steepest = straight * cone_cos + math.sqrt(max(1.0 - straight * straight, 0.0)) * cone_sin
    return min(away / steepest, best) if steepest > 1e-12 else best


@small_kernel
def to_box(x, y, ux, uy, c, s, half_l, half_w, cone_cos, cone_sin, best):
    """Return the distance in a cone to a box, at most `best` [m].

    If the nearest point of the box is outside the cone, the nearest point inside is on one of
    the edges of the cone, since the box is convex.

    Args:
        x: x of the tip relative to the centre of the box [m].
        y: y of the tip relative to the centre of the box [m].
        ux: x of the axis of the cone, of length 1.
        uy: y of the axis of the cone, of length 1.
        c: Cosine of the angle of the box.
        s: Sine of the angle of the box.
        half_l: Half length of the box [m].
        half_w: Half width of the box [m].
        cone_cos: Cosine of half the angle of the cone.
        cone_sin: Sine of half the angle of the cone.
        best: Smallest distance found so far [m].
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
    """Return the distance along a ray to an axis-aligned box; infinite if it misses [m]."""
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
