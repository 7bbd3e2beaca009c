"""Who gets which place: paths that do not cross needlessly.

The places go to cars so that the sum of squared distances is least (Hungarian method). Straight
paths to places chosen so do not cross, and the choice stays when all places are shifted
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
    """Index of the place for each car.

    Args:
        pos: Where the cars stand, (car, 2) [m].
        places: As many places, (place, 2) [m], in the same frame up to a shift.

    Returns:
        (car)
    """
    a, b = pos - pos.mean(axis=0), places - places.mean(axis=0)
    cost = np.sum((a[:, None] - b[None, :]) ** 2, axis=-1)
    chosen: I64 = linear_sum_assignment(cost)[1].astype(np.int64)
    return chosen


def assign_round(arc: F64, length: float) -> F64:
    """Even places on a closed curve, in the order in which the cars stand along it.

    Args:
        arc: Where the cars stand, (car) [m].
        length: Of the curve [m].

    Returns:
        Arc of each car's place, (car) [m], put so that the places are nearest to the cars.
    """
    order = np.argsort(np.argsort(np.mod(arc, length), kind="stable"), kind="stable")
    slots = length / len(arc) * order
    turn = 2.0 * np.pi / length
    phase = np.angle(np.mean(np.exp(1j * turn * (arc - slots)))) / turn
    places: F64 = (slots + phase).astype(np.float64)
    return places
