"""What cars may know at one instant, from simulation or hardware."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from relpos_env.interface._view_kernels import see_estimate, see_truth
from relpos_env.interface.beams import FARTHEST
from tracking.arrays import F64, I64, Bool
from tracking.estimate import TeamEstimate
from tracking.kernels.jit import bind


class AgentView(NamedTuple):
    """Arrays over (env, car, ...) and, of the others, over (env, car, other, ...).

    Relative quantities are in the plane of the world frame; the observation modes turn them into
    the frame of each car. A car is no other of its own: its entries are zero, its masks False.
    """

    pos: F64
    """Position of the other relative to the car, (env, car, other, 2) [m]."""
    vel: F64
    """Its velocity relative to the car, (env, car, other, 2) [m/s]."""
    cov: F64
    """Covariance of that position: xx, yy, xy, (env, car, other, 3) [m2]; 0 for the truth."""
    ok: Bool
    """True where position and velocity can be used."""
    status: I64
    """A `tracking.Status`; what a car without power knows of anyone is absent."""
    age: F64
    """Time since the last range of the pair [s]."""
    nlos: F64
    """Probability that the last range was not line of sight [-]."""
    heading: F64
    """Heading by the car's own tracker, (env, car) [rad]."""
    oriented: Bool
    """True where the heading is known, (env, car)."""
    distance: F64
    """Last range of the pair as it came [m]; 0 before the first."""
    heard: F64
    """When that was, (env, car, other) [s]; -inf before the first."""
    gap: F64
    """Received less first-path power of that range [dB]."""
    target: F64
    """Where the other should be relative to the car, (env, car, other, 2) [m]."""
    wanted: Bool
    """False where the task gives it no place."""
    command: F64
    """Velocity that the operator asks for, (env, car, 2) [m/s]."""
    speed: F64
    """Forward speed by the car's own odometer, (env, car) [m/s]."""
    steering: F64
    """Steering angle by its own servo, (env, car) [rad]."""
    near: F64
    """Distance by the car's own sensors to what is nearest, straight ahead, then counter-clockwise,
    (env, car, beam) [m]; of walls, boxes and cars alike."""
    present: Bool
    """True while the car is in the room, (env, car)."""
    now: F64
    """(env) [s]"""

    def part(self, envs: slice) -> AgentView:
        """Some of the environments; shares their memory."""
        return AgentView._make(array[envs] for array in self)


def make_view(n_envs: int, n_cars: int, n_beams: int = 0) -> AgentView:
    """A view in which nothing is known, and no beam meets anything."""
    own, other = (n_envs, n_cars), (n_envs, n_cars, n_cars)
    return AgentView(
        pos=np.zeros((*other, 2)),
        vel=np.zeros((*other, 2)),
        cov=np.zeros((*other, 3)),
        ok=np.zeros(other, dtype=bool),
        status=np.zeros(other, dtype=np.int64),
        age=np.zeros(other),
        nlos=np.zeros(other),
        heading=np.zeros(own),
        oriented=np.zeros(own, dtype=bool),
        distance=np.zeros(other),
        heard=np.full(other, -np.inf),
        gap=np.zeros(other),
        target=np.zeros((*other, 2)),
        wanted=np.zeros(other, dtype=bool),
        command=np.zeros((*own, 2)),
        speed=np.zeros(own),
        steering=np.zeros(own),
        near=np.full((*own, n_beams), FARTHEST),
        present=np.zeros(own, dtype=bool),
        now=np.zeros(n_envs),
    )


def bind_view(
    view: AgentView, estimate: TeamEstimate, powered: Bool, turns: F64
) -> Callable[[], None]:
    """What writes into a view what trackers tell, carried to `view.now` at constant velocity.

    Args:
        view: Written at every call: everything of the others but ranges and targets, and headings.
        estimate: Of the same environments, at one time each; filled before every call.
        powered: Which cars' trackers run, (env, car).
        turns: How far every car has turned since then, by its own gyroscope, (env, car) [rad].
    """
    i, j = (np.ascontiguousarray(column) for column in estimate.constellation.pairs.T)
    e = estimate
    motion = (e.pos_ij_w, e.vel_ij_w, e.cov, e.q_wb)
    rest = (e.has_orientation, e.age, e.nlos_prob, e.status, e.t)
    return bind(see_estimate, motion, rest, i, j, powered, turns, view)


def reveal(view: AgentView, pos_w: F64, vel_w: F64, heading: F64) -> None:
    """Write the truth in place of what trackers tell, for modes that need it.

    Args:
        view: Written, as by `update_view`.
        pos_w: (env, car, 2) [m]
        vel_w: (env, car, 2) [m/s]
        heading: (env, car) [rad]
    """
    see_truth(pos_w, vel_w, heading, view)
