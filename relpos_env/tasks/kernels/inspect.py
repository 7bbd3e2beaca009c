"""Compiled part of the `inspect` task: which points of walls the cars see."""

from __future__ import annotations

from relpos_env.sensors.radio._occlusion_kernels import crosses_box
from tracking.kernels.jit import kernel


@kernel
def see_walls(pos, known, points, boxes, reach, seen, gain):
    """Mark the points that cars see for the first time.

    Args:
        pos: Positions of the cars, (car, 2) [m].
        known: True for cars that are present and know where they are, (car).
        points: Points in front of walls, (point, 2) [m].
        boxes: Centre, half width and depth [m], cosine, sine, (box, 6).
        reach: Distance up to which a car sees a wall [m].
        seen: Points seen so far, (point), updated.
        gain: Share of the points that each car is the first to see, (car), written.
    """
    for k in range(pos.shape[0]):
        gain[k] = 0.0
        if not known[k]:
            continue
        x, y = pos[k, 0], pos[k, 1]
        for p in range(points.shape[0]):
            if seen[p] or (points[p, 0] - x) ** 2 + (points[p, 1] - y) ** 2 > reach * reach:
                continue
            hidden = False
            for b in range(boxes.shape[0]):
                hidden = hidden or crosses_box(x, y, points[p, 0], points[p, 1], boxes[b], 0.0)
            if not hidden:
                seen[p] = True
                gain[k] += 1.0 / points.shape[0]
