"""Simulated exercises of a person: consecutive bouts with short pauses in between.

Every person has a size and a path of their own, and every bout its own rate and reach.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from relpos_env.people.easing import ease
from relpos_env.people.exercises import exercise
from relpos_env.people.motion import BodySamples
from relpos_env.people.path import Path
from relpos_env.people.pose import Pose, join_poses
from relpos_env.people.skeleton import body_samples
from relpos_env.people.skeleton_size import SkeletonSize
from tracking.arrays import F64


def procedural_pose(
    exercises: tuple[str, ...],
    room: tuple[float, float],
    seconds: float,
    still: float,
    dt: float,
    rng: np.random.Generator,
) -> tuple[SkeletonSize, Pose, F64]:
    """Return the pose of a person who is at rest first and then repeats the exercises.

    Args:
        exercises: Names in `EXERCISES`, in order.
        room: Size along x and along y [m]; the person stays inside.
        seconds: Length of the run [s].
        still: Duration of the initial rest [s].
        dt: Time step [s].
        rng: Generator of the person and of the variations between bouts.

    Returns:
        The person's size, the pose, and its times, (time) [s].
    """
    names = [exercise(name) for name in exercises]
    size = SkeletonSize(height=float(np.clip(rng.normal(1.74, 0.09), 1.52, 1.98)))
    path, way = Path(room, rng), 0.0
    n = round(seconds / dt) + 1
    poses = [_pause(size, path, way, still, dt)]
    done, k = poses[0].n_times, 0
    while done < n:
        bout = names[k % len(names)](size, path, way, dt, rng)
        way = bout.way
        rest = _pause(size, path, way, float(rng.uniform(0.3, 1.0)), dt)
        poses += [bout.pose, rest]
        done += bout.pose.n_times + rest.n_times
        k += 1
    t = dt * np.arange(n, dtype=np.float64)
    pose = join_poses(poses).head(n)
    return size, replace(pose, pelvis_w=pose.pelvis_w + _sway(t, still, rng)), t


def procedural_body(
    exercises: tuple[str, ...],
    room: tuple[float, float],
    seconds: float,
    still: float,
    dt: float,
    rng: np.random.Generator,
) -> BodySamples:
    """Return limbs and trackers of that person; arguments as for `procedural_pose`."""
    size, pose, t = procedural_pose(exercises, room, seconds, still, dt, rng)
    return body_samples(size, pose, t)


def _pause(size: SkeletonSize, path: Path, way: float, seconds: float, dt: float) -> Pose:
    pos, heading = path.at(np.full(max(round(seconds / dt), 1), way))
    return Pose.standing(size, pos, heading)


def _sway(t: F64, still: float, rng: np.random.Generator) -> F64:
    """Return the postural sway of the pelvis, some millimetres, (time, 3) [m]."""
    hz, phase = rng.uniform(0.15, 0.6, (3, 2)), rng.uniform(0.0, 2.0 * np.pi, (3, 2))
    wave = np.sin(2.0 * np.pi * hz * t[:, None, None] + phase).sum(axis=1)
    sway = np.zeros((len(t), 3))
    sway[:, :2] = 0.0025 * wave * ease((t - still) / 2.0)[:, None]
    return sway
