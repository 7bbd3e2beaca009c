"""The operator: a person with a remote control who sees the room with an error, and late.

He tells every car the velocity of the plan, and the same trim on top that brings the group
back to where the plan wants it:

    u_i(t) = plan_i(t) - k (mean_j (p_j - g_j)(t - d) + e(t - d)),   |k (...)| limited, |u_i| too

with the reaction delay d, and the error e of his eye, a stationary first-order Gauss-Markov
process on each axis. Since all get the same trim, it says nothing of who is where in the
formation: that must come from the cars' own estimates.
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
"""[s] From sample to sample."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OperatorSimParams:
    """What the simulated operator does. A gain of 0 leaves the plan alone."""

    gain: float = 0.4
    """[1/s] Trim per metre that the group is off. Larger holds it more firmly; with the delay,
    much more than 1 / (2 reaction) swings. Author's choice, for a person who is not in a hurry."""
    reaction: float = 0.3
    """[s] From seeing to moving the stick, in whole control steps: choice reactions of people
    take 0.25 to 0.4 s (Hick, Q. J. Exp. Psychol. 4 (1952) 11)."""
    position_std: float = 0.15
    """[m] Of the error on each axis of where the group seems to be. Author's choice."""
    position_time: float = 5.0
    """[s] Correlation time of that error. Author's choice."""
    max_trim: float = 0.5
    """[m/s] Largest trim."""
    max_speed: float = 2.0
    """[m/s] Largest velocity asked of a car."""
    share: float = 1.0
    """[-] Of episodes that have an operator. In the others the plan alone is asked for, as on
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
    """What the operator sees of the world."""

    @property
    def pos_w(self) -> F64:
        """Position, (env, car, 2) [m]."""

    @property
    def present(self) -> Bool:
        """Who is in the room, (env, car)."""


class Wanted(Protocol):
    """What the operator is told of the task."""

    @property
    def plan(self) -> F64:
        """Velocity wanted by the plan, (env, car, 2) [m/s]."""

    @property
    def goal_w(self) -> F64:
        """Where the plan wants the car, (env, car, 2) [m]."""


class Operator:
    """One operator a room, sampled once a control step.

    Laws: same seed, same error, whatever the cars do and in whatever batch; no error, no delay
    and a gain pull the group's mean to that of its goals.
    """

    def __init__(self, params: OperatorSimParams, n_cars: int, n_envs: int) -> None:
        """Make the arrays.

        Args:
            params: The same for all rooms.
            n_cars: Slots for cars.
            n_envs: Environments.
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
        """Velocity asked of each car in the world frame, (env, car, 2) [m/s]."""
        self._seeds = np.zeros(n_envs, dtype=np.uint64)
        self._counts, self._gains = np.zeros(n_envs, dtype=np.int64), np.zeros(n_envs)
        self._offset, self._seen = np.zeros((n_envs, 2)), np.zeros((n_envs, depth, 2))
        self._n_envs = n_envs

    def reset(self, seeds: NDArray[np.uint64], envs: slice) -> None:
        """Begin an episode.

        Args:
            seeds: One for each of these environments.
            envs: Which begin.
        """
        self._seeds[envs] = seeds
        draw_gains(self._seeds[envs], self._gain, self._share, self._gains[envs])
        self._counts[envs] = 0
        self._offset[envs] = 0.0
        self._seen[envs] = 0.0
        self.command[envs] = 0.0

    def sample(self, state: Seen, task: Wanted, envs: slice) -> F64:
        """See the room and tell the cars.

        Args:
            state: The truth, of all environments.
            task: Plan and goals of now, of all environments.
            envs: Which to sample, contiguous.

        Returns:
            `command`, of all environments; the array is written again at the next sample.

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
