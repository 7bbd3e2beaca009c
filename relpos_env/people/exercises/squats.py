"""Squats: down and up on both feet, the trunk tilted, the arms stretched forward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from relpos_env.people.easing import window
from relpos_env.people.exercises.base import Bout, step_times
from relpos_env.people.path import Path
from relpos_env.people.pose import Pose
from relpos_env.people.skeleton_size import SkeletonSize


def squats(size: SkeletonSize, path: Path, way: float, dt: float, rng: np.random.Generator) -> Bout:
    """Return a bout of 4 to 8 squats, 1.4 s to 2.4 s each.

    Args:
        size: Size of the person.
        path: Path of the person, who stays in place.
        way: Position along the path [m].
        dt: Time step [s].
        rng: Generator of number, depth and rate.
    """
    n, period = int(rng.integers(4, 9)), rng.uniform(1.4, 2.4)
    deep, tilt, reach = rng.uniform([0.30, 0.35, 0.6], [0.50, 0.65, 1.5])
    t = step_times(n * period, dt)
    wobble = 0.08 * rng.standard_normal(2)
    phase = 2.0 * np.pi * t / period
    phase = phase + wobble[0] * np.sin(phase / n) + wobble[1] * np.sin(2.0 * phase / n)
    down = 0.5 * (1.0 - np.cos(phase)) * window(t, n * period, 0.5 * period)
    pos, heading = path.at(np.full(len(t), way))
    pose = Pose.standing(size, pos, heading)
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    leg = size.thigh + size.shank
    pelvis = pose.pelvis_w - np.column_stack(
        [(0.22 * deep * leg * down)[:, None] * ahead, deep * leg * down]
    )
    both = down[:, None] * np.ones(2)
    return Bout(
        pose=replace(
            pose,
            pelvis_w=pelvis,
            pelvis_tilt=0.45 * tilt * down,
            trunk_tilt=0.55 * tilt * down,
            flexion=pose.flexion + reach * both,
            elbow=pose.elbow + 0.15 * both,
        ),
        way=way,
    )
