"""Trackers of their own: every car runs its filter on its own IMU and on what its radio received.

    block, receptions -> OwnEvents -> Horizon -> Filter -> view

The estimates of a car are of its own tracker. It knows the motion of the others only from their
messages (`tracking.ranging.compiled.motion`), and ranges from its own exchanges and the tables of
other nodes.
"""

from __future__ import annotations

import copy

import numpy as np

from relpos_env.interface._own_kernels import note_own_ranges
from relpos_env.interface._view_kernels import forget_all
from relpos_env.interface.own_events import OwnEvents
from relpos_env.interface.views import AgentView, bind_view, make_view
from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.filters import FilterBuilder, build_filter
from tracking.kernels.jit import bind
from tracking.late_data.horizon import Horizon
from tracking.measurements import MeasurementBlock
from tracking.ranging.compiled.overheard import Overheard
from tracking.tracker import TrackerParams


class OwnPerception:
    """A tracker for every car of every group, and the resulting views; as `Perception`."""

    def __init__(
        self,
        constellation: Constellation,
        params: TrackerParams,
        block: MeasurementBlock,
        powered: Bool,
        overheard: Overheard,
        *,
        filter: str | FilterBuilder,
        room: int,
        n_rangefinders: int = 0,
    ) -> None:
        """Create trackers in their initial state.

        Args:
            constellation: Nodes, all on cars, in the cars' order.
            params: Parameters of the trackers.
            block: Measurements, updated in place by the caller before every step. Of them the
                trackers use the inertial samples of their own car; ranges are in `overheard`.
            powered: True where the car's tracker runs, (env, car), updated in place as well.
            overheard: What each car knows from its radio, updated in place as well.
            filter: One of `tracking.filters.FILTERS`.
            room: Capacity of a car's horizon in measurements.
            n_rangefinders: Number of distance sensors per car.
        """
        n_envs, n_cars = powered.shape
        rows = n_envs * n_cars
        self.constellation = constellation
        self._filter = build_filter(filter, constellation, params.filter, rows)
        self._own = OwnEvents(
            constellation, params.orientation, block, powered, overheard,
            follows_bias=self._filter.follows_bias,
        )  # fmt: skip
        self.horizon = Horizon(params.horizon, rows)
        self.horizon.reserve(room)
        self.view: AgentView = make_view(n_envs, n_cars, n_rangefinders)
        self.estimate = TeamEstimate.empty(constellation, np.zeros(rows))
        """Last estimates of all trackers, (env car), delayed by the horizon."""
        self._room = room
        self._now = np.zeros(rows)
        self._was_powered = np.zeros_like(powered)
        self.rebind(block, powered, overheard)

    def part(
        self, envs: slice, block: MeasurementBlock, powered: Bool, overheard: Overheard
    ) -> OwnPerception:
        """Return the part for some environments; it shares memory with the whole."""
        part, n = copy.copy(self), self.view.pos.shape[1]
        rows = slice(envs.start * n, envs.stop * n)
        part._filter, part.horizon = self._filter.part(rows), self.horizon.part(rows)
        part._own = self._own.part(envs, block, powered, overheard)
        part.view, whole = self.view.part(envs), self.estimate
        part.estimate = TeamEstimate(
            whole.constellation, whole.t[rows], *(array[rows] for array in whole.arrays)
        )
        part._now = self._now[rows]
        part._was_powered = self._was_powered[envs]
        part.rebind(block, powered, overheard)
        return part

    @property
    def n_late(self) -> I64:
        """Number of measurements that arrived too late for a horizon, (env)."""
        n: I64 = self.horizon.n_late.reshape(self._powered.shape).sum(axis=1)
        return n

    @property
    def n_waiting(self) -> I64:
        """Largest number of measurements in a horizon of a car, (env)."""
        n: I64 = self.horizon.state.n_waiting.reshape(self._powered.shape).max(axis=1)
        return n

    def share(self, target: F64, has_target: Bool, command: F64) -> None:
        """Use arrays of the task and the operator in the view, without a copy.

        Args:
            target: As in `AgentView`.
            has_target: As in `AgentView`.
            command: As in `AgentView`.
        """
        self.view = self.view._replace(target=target, has_target=has_target, command=command)
        self.rebind(self._block, self._powered, self._overheard)

    def reset(self, env: int) -> None:
        """Reset trackers, horizons and ranges of one environment."""
        self._own.reset(env)
        n = self._powered.shape[1]
        for row in range(env * n, (env + 1) * n):
            self._filter.reset(row)
            self.horizon.reset(row)
        self._was_powered[env] = False
        forget_all(self.view, env)

    def step(self) -> None:
        """Process the block and the receptions: update trackers and view."""
        for env, car in np.argwhere(self._powered & ~self._was_powered).tolist():
            self._switch_on(env, car)
        self._was_powered[:] = self._powered
        self._own.step()
        self._now.reshape(self._powered.shape)[:] = self.view.now[:, None]
        self._wait()
        self.estimate.t[:] = self.horizon.state.released
        self._follow()
        self._see()
        # The orientation of the own car needs no message: it is that of the last sample.
        np.copyto(self.view.heading, self._own.headings, where=self.view.oriented)
        self._note()

    def _switch_on(self, env: int, car: int) -> None:
        """Reset the tracker of a car and what it received."""
        row = env * self._powered.shape[1] + car
        self._filter.reset(row)
        self.horizon.reset(row)
        self._own.switch_on(env, car)

    def rebind(self, block: MeasurementBlock, powered: Bool, overheard: Overheard) -> None:
        """Bind the kernels to their arrays; arguments as in the constructor."""
        self._block, self._powered, self._overheard = block, powered, overheard
        view, rows = self.view, powered.size
        self._own.rebind(block, powered, overheard)
        due = MeasurementBlock.empty(rows, self._room)
        self._wait = self.horizon.bind(self._own.block, self._now, due)
        self._follow = self._filter.bind(due, self.estimate.with_time_axis())
        self._see = bind_view(view, self.estimate, powered, np.zeros(powered.shape))
        self._note = bind(note_own_ranges, self._own.events, view)

    def __getstate__(self) -> dict[str, object]:
        """Return the state without the bound kernels; the owner must call `rebind` again."""
        bound = ("_wait", "_follow", "_see", "_note")
        return {k: v for k, v in self.__dict__.items() if k not in bound}
