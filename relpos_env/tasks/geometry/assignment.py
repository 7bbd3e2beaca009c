"""Assignment of slots to cars.

The assignment minimises the sum of squared distances (Hungarian method). Straight paths to the
assigned slots then do not cross, and the assignment does not change when all slots are shifted
together [1].

References:
    [1] Turpin, Michael, Kumar, CAPT: Concurrent assignment and planning of trajectories for
        multiple robots, IJRR 33 (2014) 98.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from tracking.arrays import F64, I64


def assign(pos: F64, places: F64) -> I64:
    """Return the index of the slot of each car.

    Args:
        pos: Positions of the cars, (car, 2) [m].
        places: Slots, as many as cars, (slot, 2) [m], in the same frame up to a shift.

    Returns:
        Index of the slot, (car).
    """
    a, b = pos - pos.mean(axis=0), places - places.mean(axis=0)
    cost = np.sum((a[:, None] - b[None, :]) ** 2, axis=-1)
    chosen: I64 = linear_sum_assignment(cost)[1].astype(np.int64)
    return chosen


def assign_round(arc: F64, length: float) -> F64:
    """Return evenly spaced slots on a closed curve, in the order of the cars along it.

    Args:
        arc: Arc lengths of the cars, (car) [m].
        length: Length of the curve [m].

    Returns:
        Arc length of each car's slot, (car) [m]; the common offset is a circular mean.
    """
    order = np.argsort(np.argsort(np.mod(arc, length), kind="stable"), kind="stable")
    slots = length / len(arc) * order
    turn = 2.0 * np.pi / length
    phase = np.angle(np.mean(np.exp(1j * turn * (arc - slots)))) / turn
    places: F64 = (slots + phase).astype(np.float64)
    return places
