"""Snapshot for the safety gate: the estimates behind an action, and their uncertainty."""

from __future__ import annotations

import numpy as np

from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.safety.params import Fence
from hardware_bridge.safety.picture import Picture, blank_picture, largest_std
from tracking.arrays import F64, Bool
from tracking.estimate import Status

PLANE = np.array([0, 1, 3, 4])
"""Rows of a covariance that belong to the plane: position and velocity."""


def draw_picture(
    swarm: LiveSwarm, t: float, speed: F64, steering: F64, fence: Fence | None
) -> Picture:
    """Return the current snapshot.

    Args:
        swarm: Trackers after their last step.
        t: Time of that step, by the host's clock [s].
        speed: Requested speed, (slot) [m/s].
        steering: Requested steering angle, (slot) [rad].
        fence: Fence, whose node is the origin of positions; None without a fence.
    """
    view, group, n = swarm.view, swarm.group, swarm.config.n_slots
    q = blank_picture(1, n)
    q.t[0] = t
    q.requested_speed[0], q.requested_steering[0] = speed, steering
    q.present[0], q.oriented[0] = view.present[0], view.oriented[0]
    q.heading[0], q.speed[0] = view.heading[0], view.speed[0]
    q.status[0], q.pos[0], q.vel[0] = view.status[0], view.pos[0], view.vel[0]
    q.distance[0] = view.distance[0]
    q.ranged[0] = view.t_last_range[0] + swarm.intake.start_ns * 1e-9
    q.sigma[0] = largest_std(view.cov[0])
    sound = is_sound(swarm.estimate.cov[0])
    for pair, (i, j) in enumerate(group.pairs.tolist()):
        if j < n:
            q.sound[0, i, j] = q.sound[0, j, i] = sound[pair]
    swarm.silent.write(q, view)
    if fence is not None:
        _place(swarm, q, group.index_of[fence.node], sound)
    return q


def is_sound(cov: F64) -> Bool:
    """Return whether covariances are valid in the plane: finite, symmetric, positive definite.

    Args:
        cov: Covariance of position and velocity, (pair, 6, 6).

    Returns:
        True for valid covariances, (pair).
    """
    plane = cov[:, PLANE[:, None], PLANE[None, :]]
    finite: Bool = np.all(np.isfinite(plane), axis=(1, 2))
    plane = np.where(finite[:, None, None], plane, np.eye(4))
    skew = np.abs(plane - np.swapaxes(plane, 1, 2)).max(axis=(1, 2))
    symmetric = skew <= 1e-9 * np.maximum(np.abs(plane).max(axis=(1, 2)), 1e-12)
    sound: Bool = finite & symmetric & np.array(np.linalg.eigvalsh(plane)[:, 0] > 0.0)
    return sound


def _place(swarm: LiveSwarm, q: Picture, post: int, sound: Bool) -> None:
    """Write the positions of the cars relative to the node of the fence."""
    e, group = swarm.estimate, swarm.group
    ok: Bool = np.asarray(e.status == Status.OK)
    elapsed = float(swarm.view.now[0] - e.t[0])
    for k in range(swarm.config.n_slots):
        pair = int(group.pair_index[post, k])
        pos, vel = e.between(post, k)
        cov = e.cov[0, pair]
        q.placed[0, k] = float(ok[0, pair] and sound[pair] and swarm.view.present[0, k])
        q.place[0, k] = pos[0, :2] + elapsed * vel[0, :2]
        grown = cov[:2, :2] + elapsed * (cov[:2, 3:5] + cov[3:5, :2]) + elapsed**2 * cov[3:5, 3:5]
        q.place_sigma[0, k] = largest_std(np.array([grown[0, 0], grown[1, 1], grown[0, 1]]))
