"""Lines of sight between points of a room."""

from __future__ import annotations

import numpy as np

from relpos_env.sensors.radio._occlusion_kernels import pairs_cross_boxes
from tracking.arrays import F64, Bool


def pairs_in_sight(pos: F64, boxes: F64) -> Bool:
    """Return which pairs of points have line of sight.

    Args:
        pos: Positions, (point, 2) [m].
        boxes: Centre, half width and depth [m], cosine, sine, (box, 6).

    Returns:
        True without a box in between, (point, point).
    """
    sight = np.ones((len(pos), len(pos)), dtype=bool)
    pairs_cross_boxes(np.ascontiguousarray(pos), boxes, sight)
    return sight
