"""Information available to cars at one instant, from simulation or hardware."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from relpos_env.interface._view_kernels import see_estimate, see_truth
from relpos_env.interface.rangefinders import FARTHEST
from tracking.arrays import F64, I64, Bool
from tracking.estimate import TeamEstimate
from tracking.kernels.jit import bind


class AgentView(NamedTuple):
    """Arrays over (env, car, ...) and, for the other cars, over (env, car, other, ...).

    Relative quantities are in the plane of the world frame; the observation modes rotate them to
    the body frame of each car. Diagonal entries (other = car) are zero, their masks False.
    """

    pos: F64
    """Position of the other relative to the car, (env, car, other, 2) [m]."""
    vel: F64
    """Velocity of the other relative to the car, (env, car, other, 2) [m/s]."""
    cov: F64
    """Covariance of `pos`: xx, yy, xy, (env, car, other, 3) [m2]; 0 for the true state."""
    ok: Bool
    """True where position and velocity are usable, (env, car, other)."""
    status: I64
    """`tracking.Status`, (env, car, other); absent for a car without power."""
    age: F64
    """Time since the last range of the pair, (env, car, other) [s]."""
    nlos: F64
    """Probability that the last range was NLOS, (env, car, other) [-]."""
    heading: F64
    """Heading from the car's own tracker, (env, car) [rad]."""
    oriented: Bool
    """True where the heading is known, (env, car)."""
    distance: F64
    """Last raw range of the pair, (env, car, other) [m]; 0 before the first."""
    t_last_range: F64
    """Time of the last range, (env, car, other) [s]; -inf before the first."""
    gap: F64
    """Total minus first-path received power of the last range, (env, car, other) [dB]."""
    target: F64
    """Target position of the other relative to the car, (env, car, other, 2) [m]."""
    has_target: Bool
    """True where the task sets a target, (env, car, other)."""
    command: F64
    """Velocity commanded by the operator, (env, car, 2) [m/s]."""
    speed: F64
    """Forward speed from the car's own odometer, (env, car) [m/s]."""
    steering: F64
    """Steering angle of the car's own servo, (env, car) [rad]."""
    near: F64
    """Readings of the car's distance sensors (walls, boxes and cars), the first straight ahead,
    then counter-clockwise, (env, car, sensor) [m]."""
    present: Bool
    """True while the car is in the room, (env, car)."""
    now: F64
    """Time of the view, (env) [s]."""

    def part(self, envs: slice) -> AgentView:
        """Return the part for some environments; it shares memory with the whole."""
        return AgentView._make(array[envs] for array in self)


def make_view(n_envs: int, n_cars: int, n_rangefinders: int = 0) -> AgentView:
    """Return a view without estimates, with distance sensors at their maximum range."""
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
        t_last_range=np.full(other, -np.inf),
        gap=np.zeros(other),
        target=np.zeros((*other, 2)),
        has_target=np.zeros(other, dtype=bool),
        command=np.zeros((*own, 2)),
        speed=np.zeros(own),
        steering=np.zeros(own),
        near=np.full((*own, n_rangefinders), FARTHEST),
        present=np.zeros(own, dtype=bool),
        now=np.zeros(n_envs),
    )


def bind_view(
    view: AgentView, estimate: TeamEstimate, powered: Bool, turns: F64
) -> Callable[[], None]:
    """Return a function that writes estimates, predicted to `view.now`, into a view.

    Args:
        view: Written at every call: relative quantities except ranges and targets, and headings.
        estimate: Estimates of the same environments, or of every car's own tracker, (env car);
            updated before every call.
        powered: True where the car's tracker runs, (env, car).
        turns: Rotation of every car since the estimate, by its gyroscope, (env, car) [rad].
    """
    i, j = (np.ascontiguousarray(column) for column in estimate.constellation.pairs.T)
    e = estimate
    motion = (e.pos_ij_w, e.vel_ij_w, e.cov, e.q_wb)
    rest = (e.has_orientation, e.age, e.nlos_prob, e.status, e.t)
    n_trackers = max(len(e.t) // len(powered), 1)
    return bind(see_estimate, motion, rest, i, j, powered, turns, n_trackers, view)


def reveal(view: AgentView, pos_w: F64, vel_w: F64, heading: F64) -> None:
    """Write the true state in place of estimates, for modes that need it.

    Args:
        view: Written, as by `bind_view`.
        pos_w: Positions, (env, car, 2) [m].
        vel_w: Velocities, (env, car, 2) [m/s].
        heading: Headings, (env, car) [rad].
    """
    see_truth(pos_w, vel_w, heading, view)
