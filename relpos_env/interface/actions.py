"""Actions of policies. A new action mode needs a class here and a line in `ACTIONS`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from gymnasium import spaces

from relpos_env.errors import EnvError
from relpos_env.registry import build, look_up
from tracking.arrays import F64
from tracking.params.short_repr import short_repr

MAX_SPEED = 2.0
"""[m/s] Largest commanded speed."""
MAX_STEERING = 0.42
"""[rad] Largest commanded steering angle."""


@dataclass(frozen=True, slots=True)
class DriveCommand:
    """Drive commands of every car of a group, (car)."""

    __repr__ = short_repr

    t: float
    """Time of the command [s]."""
    speed: F64
    """Commanded forward speed [m/s]; negative is backwards."""
    steering: F64
    """Commanded steering angle [rad]; positive turns left."""


@runtime_checkable
class ActionMode(Protocol):
    """Mapping of actions to drive commands."""

    def space(self) -> spaces.Space[Any]:
        """Return the action space of one car."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the action of one car."""

    def decode(self, actions: Any, where: str) -> tuple[F64, F64]:
        """Return the speed [m/s] and steering [rad] of actions.

        Args:
            actions: Actions, (..., *shape).
            where: Name of the actions in errors.

        Raises:
            EnvError: An action is not finite, or outside a space that does not clip.
        """


class ContinuousActions:
    """Two numbers in [-1, 1]: speed and steering as fractions of their largest values.

    Left is positive. Numbers outside the interval are clipped.
    """

    shape = (2,)

    def space(self) -> spaces.Box:
        """Return the action space of one car."""
        return spaces.Box(-1.0, 1.0, shape=self.shape, dtype=np.float32)

    def decode(self, actions: Any, where: str) -> tuple[F64, F64]:
        """Return speed and steering; see `ActionMode`."""
        try:
            actions = np.asarray(actions, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise EnvError(f"{where}: expected numbers, got {actions!r}") from error
        finite = np.isfinite(actions)
        if not finite.all():
            bad = actions[tuple(np.argwhere(~finite)[0])]
            raise EnvError(f"{where}: expected finite numbers, got {bad}")
        clipped = np.minimum(np.maximum(actions, -1.0), 1.0)
        return clipped[..., 0] * MAX_SPEED, clipped[..., 1] * MAX_STEERING


class DiscreteActions:
    """Fifteen actions: backwards, stop or forwards, and five steering angles from right to left.

    Action ``5 g + s``: speed -0.5, 0 or 1 m/s for g = 0, 1, 2; steering -0.42 rad to 0.42 rad for
    s = 0 to 4.
    """

    shape = ()
    speeds = np.array([-0.5, 0.0, 1.0])
    angles = MAX_STEERING * np.array([-1.0, -0.5, 0.0, 0.5, 1.0])

    def space(self) -> spaces.Discrete:
        """Return the action space of one car."""
        return spaces.Discrete(len(self.speeds) * len(self.angles))

    def decode(self, actions: Any, where: str) -> tuple[F64, F64]:
        """Return speed and steering; see `ActionMode`."""
        actions = np.asarray(actions)
        n = len(self.speeds) * len(self.angles)
        if not np.issubdtype(actions.dtype, np.integer) or actions.min() < 0 or actions.max() >= n:
            raise EnvError(f"{where}: expected whole numbers from 0 to {n - 1}, got {actions}")
        gear, side = np.divmod(actions, len(self.angles))
        return self.speeds[gear], self.angles[side]


ACTIONS: dict[str, Callable[[], ActionMode]] = {
    "continuous": ContinuousActions,
    "discrete": DiscreteActions,
}
"""Name to builder."""


def action_mode(name: str | Callable[[], ActionMode]) -> ActionMode:
    """Build an action mode from its name or builder.

    Args:
        name: One of `ACTIONS`, ``package.module:Name``, a name among the entry points
            ``relpos_env.actions``, or a builder.

    Raises:
        EnvError: There is no action mode of this name.
    """
    builder = look_up(ACTIONS, name, "actions", group="relpos_env.actions")
    expected = "actions: expected a function () that returns an ActionMode"
    return build(builder, name, (), ActionMode, expected)
