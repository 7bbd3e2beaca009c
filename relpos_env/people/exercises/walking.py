"""Walking along the path: feet are planted, swing forward, and are planted again.

The gait is a function of steps u: the pelvis is at u step lengths, and a foot planted at m stays
there while the pelvis moves from m - 1/2 to m + 1/2 + `DOUBLE`. u(t) starts and ends smoothly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relpos_env.people.easing import bump, ease, ease_integral, window
from relpos_env.people.exercises.base import Bout, step_times, too_long
from relpos_env.people.path import Path
from relpos_env.people.pose import SIDES, STANCE, TOE_OUT, Pose, ball_at
from relpos_env.people.skeleton_size import SkeletonSize
from tracking.arrays import F64

DOUBLE = 0.1
"""[steps] Duration of double support in every step."""
RISE, HEEL = 0.05, 0.95
"""[m, rad] Lift of a foot and of its heel in a full step."""
RAMP = 0.9
"""[s] Time from standing to full speed."""


def walking(
    size: SkeletonSize, path: Path, way: float, dt: float, rng: np.random.Generator
) -> Bout:
    """Return a walk of 12 to 24 steps at 0.7 m/s to 1.1 m/s.

    Args:
        size: Size of the person.
        path: Path to walk on.
        way: Position along the path at the start [m].
        dt: Time step [s].
        rng: Generator of steps, cadence and swing.
    """
    n_steps = int(rng.integers(12, 25))
    length = size.height / 1.75 * rng.uniform(0.46, 0.60)
    cadence = rng.uniform(1.55, 1.9)
    first = int(rng.integers(2))
    swing, sway, bounce, turn = rng.uniform([0.25, 0.012, 0.013, 0.05], [0.55, 0.025, 0.022, 0.10])
    width = STANCE * rng.uniform(0.55, 0.85)
    t = step_times(n_steps / cadence + RAMP, dt)
    u = cadence * (
        RAMP * ease_integral(t / RAMP) - RAMP * ease_integral((t - n_steps / cadence) / RAMP)
    )
    u = np.minimum(u, n_steps)
    level = ease(u) * ease(n_steps - u)
    on_path = way + length * u
    pos, heading = path.at(on_path)
    wave = SIDES[first] * np.sin(np.pi * u) * level
    aside = -sway * SIDES[first] * np.cos(np.pi * u) * level
    pos = pos + aside[:, None] * np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    pose = Pose.standing(size, pos, heading)
    pelvis = pose.pelvis_w.copy()
    pelvis[:, 2] += level * bounce * np.cos(2.0 * np.pi * u)
    walk = _Walk(size, path, way, length, n_steps, width)
    feet = [walk.foot(u, side, late=side != first) for side in (0, 1)]
    arms = swing * SIDES * SIDES[first] * -np.sin(np.pi * u)[:, None] * level[:, None]
    pose = replace(
        pose,
        pelvis_w=pelvis,
        pelvis_turn=-turn * wave,
        twist=2.0 * turn * wave,
        trunk_tilt=0.06 * level,
        ball_w=np.stack([ball for ball, _, _ in feet], axis=1),
        foot_yaw=np.stack([yaw for _, yaw, _ in feet], axis=1),
        heel_lift=np.stack([lift for _, _, lift in feet], axis=1),
        flexion=arms,
        elbow=pose.elbow + 0.5 * np.maximum(swing, 0.3) * level[:, None] + 0.5 * arms,
    )
    low = window(t, float(t[-1]), 0.7 * RAMP)
    return Bout(pose=_lowered(size, pose, low), way=float(on_path[-1]))


@dataclass(frozen=True, slots=True)
class _Walk:
    """Footholds of a walk."""

    size: SkeletonSize
    path: Path
    way: float
    """Position along the path at the start [m]."""
    length: float
    """Length of a step [m]."""
    n_steps: int
    width: float
    """Distance from the middle to each foot while walking [m]."""

    def foot(self, u: F64, side: int, *, late: bool) -> tuple[F64, F64, F64]:
        """Return the motion of one foot.

        Args:
            u: Steps done, (time) [-].
            side: 0 right, 1 left.
            late: True if it makes the second step, not the first.

        Returns:
            Ball of the foot, (time, 3) [m], yaw and heel lift, (time) [rad].
        """
        ball, yaw, lift = np.zeros((len(u), 3)), np.zeros(len(u)), np.zeros(len(u))
        last, last_place, last_yaw = 0, np.zeros(3), 0.0
        for m in (0, *range(1 + late, self.n_steps, 2), self.n_steps):
            at, heading = self.path.at(np.array([self.way + self.length * m]))
            apart = STANCE if m in (0, self.n_steps) else self.width
            place = ball_at(self.size, at, heading, apart)[0, side]
            if m == 0:
                ball += place
                yaw += heading[0]
            else:
                begin = last + 0.5 + DOUBLE if last or late else 0.02
                end = m if last == self.n_steps - 1 else m - 0.5
                swing = (u - begin) / (end - begin)
                ball += ease(swing)[:, None] * (place - last_place)
                yaw += ease(swing) * (heading[0] - last_yaw)
                far = min(0.5 * (m - last), 1.0)
                ball[:, 2] += RISE * far * bump(swing)
                # The heel leaves the floor before the toe does.
                early = min(0.25, begin)
                lift += HEEL * far * bump((u - begin + early) / (end - begin + early))
            last, last_place, last_yaw = m, place, heading[0]
        return ball, yaw + SIDES[side] * TOE_OUT, lift


def _lowered(size: SkeletonSize, pose: Pose, share: F64) -> Pose:
    """Return the pose with the pelvis lowered as far as the legs need it, weighted by `share`."""
    for _ in range(3):
        need = too_long(size, pose)
        depth = np.max(need / np.maximum(share, 0.2))
        pelvis = pose.pelvis_w.copy()
        pelvis[:, 2] -= 1.15 * depth * share
        pose = replace(pose, pelvis_w=pelvis)
    return pose
