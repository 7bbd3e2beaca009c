"""Interface of the position filters: events in, estimates out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

from tracking.arrays import F64
from tracking.estimate import TeamEstimate
from tracking.kernels.jit import Call
from tracking.measurements import MeasurementBlock


@runtime_checkable
class Filter(Protocol):
    """A position filter over a batch of groups.

    Properties tested for every registered filter: a step without events changes nothing; any
    split into blocks gives the same estimate; environment k of a batch gives the same as alone;
    noiseless data give zero error; swapping i and j mirrors the estimate; a run that is saved and
    restored continues as if uninterrupted.
    """

    follows_bias: bool
    """True if slow acceleration errors are among the states. Tilt errors may then last, so VQF may
    trust its accelerometer less (`VehicleParams.ahrs_accel_tau_with_bias`)."""

    def run(self, block: MeasurementBlock, t_out: F64) -> TeamEstimate:
        """Process the events and return the estimates at the given times.

        Args:
            block: Events in order, later than all processed ones; STATE events, not IMU events.
            t_out: Times of the estimates, ascending, (env, time) [s].

        Returns:
            Estimates, arrays over (env, time, ...).
        """

    def bind(self, block: MeasurementBlock, estimate: TeamEstimate) -> Callable[[], None]:
        """Return a function that does `run` on fixed arrays, without its overhead.

        Args:
            block: Events, contiguous arrays that are filled again before every call.
            estimate: Written by every call for its times `t`, (env, time), which are set before.
        """

    def calls(self, block: MeasurementBlock, estimate: TeamEstimate) -> list[list[Call]]:
        """Return the kernels, with arguments of their types, in groups that share little code.

        Every event needs the first group; the others are needed now and then.
        """

    def reset(self, env: int) -> None:
        """Reset one environment to the state before any measurement."""

    def part(self, envs: slice) -> Filter:
        """Return the filter of some environments, a slice of step 1, which shares their memory."""

    def save(self) -> Any:
        """Return a copy of the state."""

    def restore(self, saved: Any) -> None:
        """Restore the state from a saved copy."""

    def mean_nis(self) -> F64:
        """Return the mean NIS over all accepted ranges, (env) [-]; NaN before the first."""

    def n_rejected(self) -> F64:
        """Return the number of ranges rejected as outliers, (env)."""
