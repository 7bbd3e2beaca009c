"""The tracker: orientation stage, then position filter.

    block -> Orientation (IMU to state) -> Filter (one joint EKF, or others) -> TeamEstimate

`Horizon` puts late data in order upstream of the tracker.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tracking.ahrs.orientation import Orientation
from tracking.ahrs.params import OrientationParams
from tracking.arrays import F64
from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.estimate import TeamEstimate
from tracking.filters import DEFAULT_FILTER, FilterBuilder, build_filter
from tracking.filters.joint import JointEkf
from tracking.filters.params import FilterParams
from tracking.kernels.jit import Call
from tracking.late_data.horizon import HorizonParams
from tracking.measurements import MeasurementBlock
from tracking.sanity.blocks import check, usable, usable_call


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerParams:
    """Parameters of all stages of the tracker."""

    orientation: OrientationParams = field(default_factory=OrientationParams)
    filter: FilterParams = field(default_factory=FilterParams)
    horizon: HorizonParams = field(default_factory=HorizonParams)


class Tracker:
    """Relative positions of a batch of groups from their measurements.

    Properties: any division of the same events into blocks gives the same estimates, bit for
    bit; a run that is saved and restored equals an uninterrupted one.
    """

    def __init__(
        self,
        constellation: Constellation,
        params: TrackerParams | None = None,
        *,
        filter: str | FilterBuilder = DEFAULT_FILTER,
        n_envs: int = 1,
    ) -> None:
        if not isinstance(constellation, Constellation):
            raise ConfigError(f"constellation: expected a Constellation, got {constellation!r}")
        if n_envs < 1:
            raise ConfigError(f"n_envs: expected 1 or more, got {n_envs}")
        params = params or TrackerParams()
        self.constellation = constellation
        self.n_envs = n_envs
        self._t = np.full(n_envs, -np.inf)
        """Time of the last event handled by `run`, (env) [s]."""
        self._filter = build_filter(filter, constellation, params.filter, n_envs)
        self._orientation = Orientation(
            constellation, params.orientation, n_envs, follows_bias=self._filter.follows_bias
        )

    def step(self, block: MeasurementBlock, t: F64 | float) -> TeamEstimate:
        """Handle a block and return the estimate at one time.

        Args:
            block: Events in order, none earlier than those handled before.
            t: Time of the estimate, scalar or (env) [s], not before the last event.

        Returns:
            Estimates, arrays over (env, ...).
        """
        t_out = np.broadcast_to(np.asarray(t, dtype=np.float64), (self.n_envs,))[:, None]
        history = self.run(block, t_out)
        names = TeamEstimate.__slots__[1:]
        return TeamEstimate(history.constellation, *(getattr(history, n)[:, 0] for n in names))

    def run(self, block: MeasurementBlock, t_out: F64) -> TeamEstimate:
        """Handle a block and return the estimates at several times.

        Args:
            block: Events in order, none earlier than those handled before. Invalid events are
                skipped (`tracking.sanity.blocks`).
            t_out: Ascending times, (time) or (env, time) [s], none before the events of earlier
                blocks. An estimate includes every event up to its time.

        Returns:
            Estimates, arrays over (env, time, ...).

        Raises:
            ConfigError: The block has other environments or nodes, or times decrease.
        """
        t_out = np.atleast_2d(np.asarray(t_out, dtype=np.float64))
        block = usable(block)
        check(block, t_out, self.n_envs, self.constellation, self._t)
        np.maximum(self._t, _last_event(block), out=self._t)
        t_out = np.broadcast_to(t_out, (self.n_envs, t_out.shape[1]))
        return self._filter.run(self._orientation.step(block), t_out)

    def bind(
        self, block: MeasurementBlock, estimate: TeamEstimate
    ) -> tuple[Callable[[], None], Callable[[], None]]:
        """Bind `step` to fixed arrays, without its overhead.

        Args:
            block: Refilled before every step, which replaces samples by states.
            estimate: Arrays over (env, ...), written by every step for its times `t`.

        Returns:
            Two functions to be called in order: orientations, then positions.
        """
        follow = self._filter.bind(block, estimate.with_time_axis())
        return self._orientation.bind(block), follow

    def calls(self) -> list[list[Call]]:
        """Return all kernels with arguments of their types, to compile them ahead of time.

        The groups share little code: kernels of the filter (`Filter.calls`), then those that
        trackers with any filter need.
        """
        block = MeasurementBlock.empty(self.n_envs)
        estimate = TeamEstimate.empty(self.constellation, np.zeros((self.n_envs, 1)))
        common = [self._orientation.call(block), usable_call(block)]
        return [*self._filter.calls(block, estimate), common]

    def smooth(self, later: MeasurementBlock, t: F64 | float) -> TeamEstimate:
        """Return the estimate at one time given later measurements; the state does not change.

        Late and out-of-order data lose nothing: data that `later` holds in order have the same
        effect as on time (see `Horizon.waiting`).

        Args:
            later: Events after t, in order.
            t: Time of the estimate, not before the last event handled, scalar or (env) [s].

        Returns:
            Estimates, arrays over (env, ...).

        Raises:
            ConfigError: The filter cannot smooth (`joint` can), or an error of `run`.
        """
        if not isinstance(self._filter, JointEkf):
            raise ConfigError("smoothing: expected filter 'joint', the others cannot look back")
        at = np.broadcast_to(np.asarray(t, dtype=np.float64), (self.n_envs,))
        later = usable(later)
        check(later, at[:, None], self.n_envs, self.constellation, self._t)
        if np.any(later.valid & (later.t < at[:, None])):
            raise ConfigError("later: expected events after t")
        saved = self._orientation.save()
        try:
            states = self._orientation.step(later)
        finally:
            self._orientation.restore(saved)
        return self._filter.smooth(states, at.copy())

    def reset(self, env: int) -> None:
        """Reset one environment."""
        self._t[env] = -np.inf
        self._orientation.reset(env)
        self._filter.reset(env)

    def part(self, envs: slice) -> Tracker:
        """Return some of the environments, without a step between them; shares their memory."""
        part = copy.copy(self)
        part.n_envs = len(range(*envs.indices(self.n_envs)))
        part._t = self._t[envs]
        part._orientation = self._orientation.part(envs)
        part._filter = self._filter.part(envs)
        return part

    def save(self) -> dict[str, Any]:
        """Return a copy of the state."""
        return {
            "t": self._t.copy(),
            "orientation": self._orientation.save(),
            "filter": self._filter.save(),
        }

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore a saved state."""
        self._t[:] = saved["t"]
        self._orientation.restore(saved["orientation"])
        self._filter.restore(saved["filter"])

    def mean_nis(self) -> F64:
        """Return the mean NIS over all accepted ranges, (env) [-]."""
        return self._filter.mean_nis()

    def range_noise(self) -> F64 | None:
        """White noise of ranges that `joint` has learned, (env) [m]; None of other filters."""
        return self._filter.range_noise() if isinstance(self._filter, JointEkf) else None

    def n_rejected(self) -> F64:
        """Return the number of ranges rejected as outliers, (env)."""
        return self._filter.n_rejected()


def _last_event(block: MeasurementBlock) -> F64:
    """Return the time of the last event of each environment, (env) [s]."""
    t: F64 = np.where(block.valid, block.t, -np.inf).max(axis=1, initial=-np.inf)
    return t
