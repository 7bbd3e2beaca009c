"""Pose of a person over time, from which the joints of a skeleton are computed.

Feet and pelvis are given, and the legs follow from them, so that a foot on the floor does not
move. All channels are arrays over time; a pair of sides is (right, left), as in `SIDES`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from relpos_env.people.skeleton_size import SkeletonSize
from tracking.arrays import F64
from tracking.params.short_repr import short_repr

SIDES = np.array([-1.0, 1.0])
"""Signs of right and left; y points left."""
STANCE = 0.14
"""[m] Distance from the middle to the ball of each foot of a standing person."""
TOE_OUT = 0.12
"""[rad] Outward angle of the feet."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """Pose of a person over time."""

    __repr__ = short_repr

    pelvis_w: F64
    """Middle between the hip joints, (time, 3) [m]."""
    heading: F64
    """Direction of walking or facing, without jumps, (time) [rad]."""
    pelvis_turn: F64
    """Yaw of the pelvis relative to the heading, to the left, (time) [rad]."""
    pelvis_tilt: F64
    """Tilt of the pelvis, forwards, (time) [rad]."""
    twist: F64
    """Yaw of the trunk relative to the pelvis, to the left, (time) [rad]."""
    trunk_tilt: F64
    """Tilt of the trunk relative to the pelvis, forwards, (time) [rad]."""
    ball_w: F64
    """Balls of the feet, (time, side, 3) [m]; on the floor if z is 0."""
    foot_yaw: F64
    """Yaw of the feet, (time, side) [rad]."""
    heel_lift: F64
    """Angle of the sole with the floor, heel up, (time, side) [rad]."""
    flexion: F64
    """Flexion of the shoulder, arm forwards, (time, side) [rad]."""
    abduction: F64
    """Abduction of the shoulder, arm sideways, (time, side) [rad]."""
    roll: F64
    """Rotation of the upper arm about its axis, outwards, (time, side) [rad]."""
    elbow: F64
    """Flexion of the elbow, (time, side) [rad]."""

    @classmethod
    def standing(cls, size: SkeletonSize, pos: F64, heading: F64) -> Pose:
        """Return the pose of an upright person at rest.

        Args:
            size: Size of the person.
            pos: Position, (time, 2) [m].
            heading: Heading, (time) [rad].
        """
        n = len(pos)
        still, sides = np.zeros(n), np.zeros((n, 2))
        return cls(
            pelvis_w=np.column_stack([pos, np.full(n, size.standing_hip(STANCE))]),
            heading=heading,
            pelvis_turn=still,
            pelvis_tilt=still,
            twist=still,
            trunk_tilt=still,
            ball_w=ball_at(size, pos, heading),
            foot_yaw=heading[:, None] + SIDES * TOE_OUT,
            heel_lift=sides,
            flexion=sides,
            abduction=sides + 0.12,
            roll=sides,
            elbow=sides + 0.25,
        )

    @property
    def n_times(self) -> int:
        """Number of times."""
        return len(self.heading)

    def head(self, n: int) -> Pose:
        """Return the pose at the first `n` times."""
        return replace(self, **{f.name: getattr(self, f.name)[:n] for f in fields(self)})


def join_poses(poses: list[Pose]) -> Pose:
    """Concatenate poses over time."""
    return Pose(
        **{f.name: np.concatenate([getattr(p, f.name) for p in poses]) for f in fields(Pose)}
    )


def ball_at(size: SkeletonSize, pos: F64, heading: F64, apart: F64 | float = STANCE) -> F64:
    """Return the balls of the feet of a standing person.

    Args:
        size: Size of the person.
        pos: Point under the middle of the pelvis, (..., 2) [m].
        heading: Heading, (...) [rad].
        apart: Distance from the middle to each foot, (...) or one number [m].

    Returns:
        Positions, (..., side, 3) [m].
    """
    c, s = np.cos(heading)[..., None], np.sin(heading)[..., None]
    side = np.asarray(apart)[..., None] * SIDES
    x = pos[..., :1] + c * size.toe_ahead - s * side
    y = pos[..., 1:] + s * size.toe_ahead + c * side
    return np.stack([x, y, np.zeros_like(x)], axis=-1)
