"""Occlusion between two antennas by upright boxes and by capsules in 3D, such as limbs."""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel, small_kernel


@small_kernel
def crosses_box(ax, ay, bx, by, box, berth):
    """Return whether the line from a to b in the plane passes through a box.

    Args:
        ax: x of end a [m].
        ay: y of end a [m].
        bx: x of end b [m].
        by: y of end b [m].
        box: Centre x y [m], half width, half depth [m], cosine and sine of its angle.
        berth: Margin around the box on all sides [m].
    """
    x, y, dx, dy = ax - box[0], ay - box[1], bx - ax, by - ay
    # Quick rejection: distance of the line from the centre of the box, times its length.
    across, half2 = x * dy - y * dx, (box[2] + berth) ** 2 + (box[3] + berth) ** 2
    if across * across > half2 * (dx * dx + dy * dy):
        return False
    c, s = box[4], box[5]
    low, high = 0.0, 1.0
    for axis in range(2):
        if axis == 0:
            start, step = c * x + s * y, c * dx + s * dy
        else:
            start, step = c * y - s * x, c * dy - s * dx
        half = box[2 + axis] + berth
        if abs(step) < 1e-12:
            if abs(start) > half:
                return False
            continue
        first, last = (-half - start) / step, (half - start) / step
        low, high = max(low, min(first, last)), min(high, max(first, last))
    return low < high


@small_kernel
def crosses_capsule(ax, ay, az, bx, by, bz, capsule, skin):
    """Return whether the line from a to b passes through the inside of a capsule.

    Args:
        ax: x of end a [m].
        ay: y of end a [m].
        az: z of end a [m].
        bx: x of end b [m].
        by: y of end b [m].
        bz: z of end b [m].
        capsule: Ends of the axis, 3 and 3 [m], and the radius [m].
        skin: Share of the radius that counts as inside, below 1: a capsule must not occlude an
            antenna that is worn on its surface.
    """
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = capsule[3] - capsule[0], capsule[4] - capsule[1], capsule[5] - capsule[2]
    wx, wy, wz = ax - capsule[0], ay - capsule[1], az - capsule[2]
    a, b, c = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    d, e = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    # Nearest points of two segments (Ericson, Real-Time Collision Detection, 5.1.9).
    det = a * c - b * b
    s = min(max((b * e - c * d) / det, 0.0), 1.0) if det > 1e-12 * a * c else 0.0
    t = (b * s + e) / c if c > 0.0 else 0.0
    if c <= 0.0 < a:  # a sphere
        s = min(max(-d / a, 0.0), 1.0)
    if t < 0.0 or t > 1.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((b * t - d) / a, 0.0), 1.0) if a > 0.0 else 0.0
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return math.sqrt(x * x + y * y + z * z) < skin * capsule[6]


@kernel
def pairs_cross_boxes(pos, boxes, sight):
    """Write which pairs of points have no box between them.

    Args:
        pos: Positions, (point, 2) [m].
        boxes: As for `crosses_box`, (box, 6).
        sight: True without a box in between, (point, point), written.
    """
    for a in range(pos.shape[0]):
        for b in range(pos.shape[0]):
            sight[a, b] = True
            for k in range(boxes.shape[0]):
                if crosses_box(pos[a, 0], pos[a, 1], pos[b, 0], pos[b, 1], boxes[k], 0.0):
                    sight[a, b] = False
