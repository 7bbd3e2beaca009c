"""What an exercise is: a bout that begins and ends standing, somewhere on the person's path."""

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
    """Some seconds of an exercise."""

    __repr__ = short_repr

    pose: Pose
    """At steps of `dt`; standing at both ends."""
    way: float
    """[m] Where on the path it ends."""


Exercise = Callable[[SkeletonSize, Path, float, float, np.random.Generator], Bout]
"""Make a bout: size of the person, path, way on it at the start [m], time step [s], and the
generator for what differs from bout to bout and from person to person."""


def step_times(seconds: float, dt: float) -> F64:
    """Times of a bout, the last one at or after its end, (time) [s].

    Args:
        seconds: Its length.
        dt: Time step [s].
    """
    return dt * np.arange(int(np.ceil(seconds / dt - 1e-9)) + 1, dtype=np.float64)


def too_long(size: SkeletonSize, pose: Pose) -> F64:
    """How much lower the pelvis would have to be for the legs to reach the feet, (time) [m].

    A leg may be stretched as far as a standing one's; never negative.

    Args:
        size: Of the person.
        pose: Over time.
    """
    stretch = leg_stretch(size, pose).max(axis=1)
    leg = size.thigh + size.shank
    return np.asarray(np.maximum(stretch - STRETCH, 0.0) * leg)
