"""Simulated operator: a person with a remote control, a reaction delay and position errors.

The operator commands the planned velocity to every car, plus a common trim that moves the
group back to its planned position:

    u_i(t) = plan_i(t) - k (mean_j (p_j - g_j)(t - d) + e(t - d)),   |k (...)| limited, |u_i| too

with the reaction delay d and the operator's position error e, a stationary first-order
Gauss-Markov process on each axis. The common trim contains no information about positions
within the formation: these must come from the cars' own estimates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from relpos_env.errors import EnvError
from relpos_env.sensors._operator_kernels import draw_gains, operate
from tracking.arrays import F64, Bool

CONTROL_STEP = 0.1
"""[s] Sampling period."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OperatorSimParams:
    """Parameters of the simulated operator. A gain of 0 does not change the plan."""

    gain: float = 0.4
    """[1/s] Trim per metre of the group's position error. Larger gains hold more firmly, but far
    above 1 / (2 reaction) they oscillate. Author's choice, for a person who is not in a hurry."""
    reaction: float = 0.3
    """[s] Reaction delay, rounded to whole control steps: choice reactions of people take
    0.25 to 0.4 s (Hick, Q. J. Exp. Psychol. 4 (1952) 11)."""
    position_std: float = 0.15
    """[m] Standard deviation of the operator's position error, per axis. Author's choice."""
    position_time: float = 5.0
    """[s] Correlation time of the operator's position error. Author's choice."""
    max_trim: float = 0.5
    """[m/s] Largest trim."""
    max_speed: float = 2.0
    """[m/s] Largest commanded speed of a car."""
    share: float = 1.0
    """[-] Share of episodes with an operator. In the others only the plan is commanded, as on
    real cars without a remote control."""

    def __post_init__(self) -> None:
        for name in ("gain", "reaction", "position_std", "max_trim"):
            value = getattr(self, name)
            if not (_is_number(value) and value >= 0.0):
                raise EnvError(f"operator {name}: expected at least 0, finite, got {value!r}")
        for name in ("position_time", "max_speed"):
            value = getattr(self, name)
            if not (_is_number(value) and value > 0.0):
                raise EnvError(f"operator {name}: expected more than 0, finite, got {value!r}")
        if not (_is_number(self.share) and 0.0 <= self.share <= 1.0):
            raise EnvError(f"operator share: expected 0 to 1, got {self.share!r}")
        if self.reaction > 5.0:
            raise EnvError(f"operator reaction: expected at most 5 s, got {self.reaction:g}")


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


class Seen(Protocol):
    """World state that the operator observes."""

    @property
    def pos_w(self) -> F64:
        """Position, (env, car, 2) [m]."""

    @property
    def present(self) -> Bool:
        """Mask of the cars in the room, (env, car)."""


class PlannedMotion(Protocol):
    """Task state that the operator receives."""

    @property
    def plan(self) -> F64:
        """Planned velocity, (env, car, 2) [m/s]."""

    @property
    def goal_w(self) -> F64:
        """Planned position, (env, car, 2) [m]."""


class Operator:
    """One operator per room, sampled once per control step.

    Properties: the error depends only on the seed, not on the cars or the batch; without error
    and delay, a positive gain moves the mean position of the group to that of its goals.
    """

    def __init__(self, params: OperatorSimParams, n_cars: int, n_envs: int) -> None:
        """Allocate the arrays.

        Args:
            params: Parameters of all operators.
            n_cars: Number of car slots.
            n_envs: Number of environments.
        """
        depth = round(params.reaction / CONTROL_STEP) + 1
        keep = float(np.exp(-CONTROL_STEP / params.position_time))
        self._gain, self._share = float(params.gain), float(params.share)
        self._limits = (
            float(params.max_trim),
            float(params.max_speed),
            float(params.position_std),
            keep,
        )
        self.command: F64 = np.zeros((n_envs, n_cars, 2))
        """Commanded velocity of each car in the world frame, (env, car, 2) [m/s]."""
        self._seeds = np.zeros(n_envs, dtype=np.uint64)
        self._counts, self._gains = np.zeros(n_envs, dtype=np.int64), np.zeros(n_envs)
        self._offset, self._seen = np.zeros((n_envs, 2)), np.zeros((n_envs, depth, 2))
        self._n_envs = n_envs

    def reset(self, seeds: NDArray[np.uint64], envs: slice) -> None:
        """Start an episode.

        Args:
            seeds: One for each of these environments.
            envs: Environments to reset.
        """
        self._seeds[envs] = seeds
        draw_gains(self._seeds[envs], self._gain, self._share, self._gains[envs])
        self._counts[envs] = 0
        self._offset[envs] = 0.0
        self._seen[envs] = 0.0
        self.command[envs] = 0.0

    def sample(self, state: Seen, task: PlannedMotion, envs: slice) -> F64:
        """Compute the commanded velocities.

        Args:
            state: True state of all environments.
            task: Current plan and goals of all environments.
            envs: Environments to sample, contiguous.

        Returns:
            `command` of all environments; the next sample overwrites the array.

        Raises:
            EnvError: `envs` is not contiguous.
        """
        start, stop, step = envs.indices(self._n_envs)
        if step != 1:
            raise EnvError(f"envs: expected a contiguous slice, got {envs}")
        operate(
            start,
            stop,
            state.pos_w,
            state.present,
            task.plan,
            task.goal_w,
            self._seeds,
            self._counts,
            self._offset,
            self._seen,
            self._gains,
            self._limits,
            self.command,
        )
        return self.command
