"""Interface of exercises: bouts that begin and end standing, on the person's path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from relpos_env.people.path import Path
from relpos_env.people.pose import Pose
from relpos_env.people.skeleton import leg_stretch
from relpos_env.people.skeleton_size import STRETCH, SkeletonSize
from tracking.arrays import F64
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class Bout:
    """One bout of an exercise."""

    __repr__ = short_repr

    pose: Pose
    """Pose at steps of `dt`; standing at both ends."""
    way: float
    """[m] Position along the path at the end."""


Exercise = Callable[[SkeletonSize, Path, float, float, np.random.Generator], Bout]
"""Function that makes a bout. Arguments: size of the person, path, position along it at the start
[m], time step [s], and generator of the variations between bouts and persons."""


def step_times(seconds: float, dt: float) -> F64:
    """Return the times of a bout, the last one at or after its end, (time) [s].

    Args:
        seconds: Length of the bout [s].
        dt: Time step [s].
    """
    return dt * np.arange(int(np.ceil(seconds / dt - 1e-9)) + 1, dtype=np.float64)


def too_long(size: SkeletonSize, pose: Pose) -> F64:
    """Return the amount to lower the pelvis for the legs to reach the feet, (time) [m].

    A leg may be stretched as far as that of a standing person. The amount is never negative.

    Args:
        size: Size of the person.
        pose: Pose over time.
    """
    stretch = leg_stretch(size, pose).max(axis=1)
    leg = size.thigh + size.shank
    return np.asarray(np.maximum(stretch - STRETCH, 0.0) * leg)
