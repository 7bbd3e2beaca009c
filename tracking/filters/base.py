"""What every filter is: events in, estimates out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from tracking.arrays import F64
from tracking.estimate import TeamEstimate
from tracking.kernels.jit import Call
from tracking.measurements import MeasurementBlock


class Filter(Protocol):
    """A position filter over a batch of groups.

    Laws, tested for every registered filter: a step without events changes nothing; any split
    into blocks gives the same estimate; environment k of a batch is that environment alone;
    noiseless data give zero error; swapping i and j mirrors; saved and restored in mid-run is
    uninterrupted.
    """

    follows_bias: bool
    """True if slow errors of the accelerations are among its states: tilts may then err for long,
    and need not be corrected by what is gravity only in the mean."""

    def run(self, block: MeasurementBlock, t_out: F64) -> TeamEstimate:
        """Handle the events and report at the given times.

        Args:
            block: Events in order, later than any handled before. STATE, not IMU.
            t_out: Times of the estimates, ascending, (env, time) [s].

        Returns:
            Estimates, arrays over (env, time, ...).
        """

    def bind(self, block: MeasurementBlock, estimate: TeamEstimate) -> Callable[[], None]:
        """`run` for arrays that stay where they are, without its overhead.

        Args:
            block: Filled again before every call, contiguous.
            estimate: Written by every call for its times `t`, (env, time), filled before.
        """

    def calls(self, block: MeasurementBlock, estimate: TeamEstimate) -> list[list[Call]]:
        """Kernels, with arguments of their types, in groups that share little code.

        The first group is needed by every event, the others now and then.
        """

    def reset(self, env: int) -> None:
        """Forget everything of one environment."""

    def part(self, envs: slice) -> Filter:
        """Some of the environments, without a step between them; shares their memory."""

    def save(self) -> Any:
        """A copy of everything that evolves."""

    def restore(self, saved: Any) -> None:
        """Go on from a saved copy."""

    def mean_nis(self) -> F64:
        """Mean NIS over all accepted ranges, (env) [-]; NaN before the first."""

    def n_rejected(self) -> F64:
        """Ranges refused as outliers, (env)."""
