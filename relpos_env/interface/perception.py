"""Processing of measurements, simulated or real, into the view of every car.

    block -> Horizon -> Tracker -> TeamEstimate -> AgentView

The tracker's estimate is as old as the horizon's delay and is predicted to the present: positions
at constant velocity, headings by the gyroscopes.
"""

from __future__ import annotations

import copy

import numpy as np

from relpos_env.interface._view_kernels import forget_all, note_ranges
from relpos_env.interface.views import AgentView, bind_view, make_view
from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.filters import FilterBuilder, FilterParams
from tracking.filters.joint.params import JointParams
from tracking.kernels.jit import bind
from tracking.late_data.horizon import Horizon
from tracking.measurements import MeasurementBlock
from tracking.tracker import Tracker, TrackerParams

OK_WITHIN = 1.0
"""[m] Accuracy required for the status ok in views: that of the shipped policies' training."""
FOR_POLICIES = FilterParams(joint=JointParams(accuracy=OK_WITHIN))
"""Filter parameters of simulated and real swarms."""


class Perception:
    """Trackers of groups of cars, and the resulting views.

    Before a `step` the caller writes the new measurements to the block, and updates `powered` and
    the view's `now`, `present`, `speed`, `steering` and `near`.
    """

    def __init__(
        self,
        constellation: Constellation,
        params: TrackerParams,
        block: MeasurementBlock,
        powered: Bool,
        overheard: object = None,
        *,
        filter: str | FilterBuilder,
        room: int,
        n_rangefinders: int = 0,
    ) -> None:
        """Create trackers in their initial state.

        Args:
            constellation: Nodes; the first ones are on the cars, in the cars' order.
            params: Parameters of the trackers.
            block: Measurements, updated in place by the caller before every step.
            powered: True where the car's tracker runs, (env, car), updated in place as well.
            overheard: Not used; see `OwnPerception`.
            filter: One of `tracking.filters.FILTERS`.
            room: Capacity of the horizon in measurements.
            n_rangefinders: Number of distance sensors per car.
        """
        n_envs, n_cars = powered.shape
        self.constellation = constellation
        self.tracker = Tracker(constellation, params, filter=filter, n_envs=n_envs)
        self.horizon = Horizon(params.horizon, n_envs)
        self.horizon.reserve(room)
        self.view: AgentView = make_view(n_envs, n_cars, n_rangefinders)
        self.estimate = TeamEstimate.empty(constellation, np.zeros(n_envs))
        """Last estimate of the tracker, delayed by the horizon, overwritten by the next."""
        self._room = room
        self.rebind(block, powered)

    def part(
        self, envs: slice, block: MeasurementBlock, powered: Bool, overheard: object = None
    ) -> Perception:
        """Return the part for some environments; it shares memory with the whole.

        Args:
            envs: Environments.
            block: As in the constructor, of these environments.
            powered: As in the constructor, of these environments.
            overheard: Not used.
        """
        part = copy.copy(self)
        part.tracker, part.horizon = self.tracker.part(envs), self.horizon.part(envs)
        part.view, whole = self.view.part(envs), self.estimate
        part.estimate = TeamEstimate(
            whole.constellation, whole.t[envs], *(array[envs] for array in whole.arrays)
        )
        part.rebind(block, powered)
        return part

    @property
    def n_late(self) -> I64:
        """Number of measurements that arrived too late for the horizon, (env)."""
        return self.horizon.n_late

    @property
    def n_waiting(self) -> I64:
        """Number of measurements in the horizon, (env)."""
        return self.horizon.state.n_waiting

    def share(self, target: F64, has_target: Bool, command: F64) -> None:
        """Use arrays of the task and the operator in the view, without a copy.

        Args:
            target: As in `AgentView`.
            has_target: As in `AgentView`.
            command: As in `AgentView`.
        """
        self.view = self.view._replace(target=target, has_target=has_target, command=command)
        self.rebind(self._block, self._powered)

    def reset(self, env: int) -> None:
        """Reset tracker, horizon and ranges of one environment."""
        self.tracker.reset(env)
        self.horizon.reset(env)
        forget_all(self.view, env)

    def make_room(self, room: int) -> None:
        """Increase the capacity of the horizon; call `rebind` afterwards."""
        self.horizon.reserve(room)
        self._room = room

    def step(self) -> None:
        """Process the block: update the horizon, the trackers and the view."""
        self._wait()
        self.estimate.t[:] = self.horizon.state.released
        self._orient()
        self._follow()
        self._turn()
        self._see()
        self._note()

    def rebind(self, block: MeasurementBlock, powered: Bool, overheard: object = None) -> None:
        """Bind the kernels to their arrays; arguments as in the constructor."""
        self._block, self._powered = block, powered
        view = self.view
        due = MeasurementBlock.empty(len(view.now), self._room)
        self._wait = self.horizon.bind(block, view.now, due)
        self._orient, self._follow = self.tracker.bind(due, self.estimate)
        # The nodes on cars come first; there may be others.
        turns = np.zeros((len(view.now), self.constellation.n_nodes))
        self._turn = self.horizon.bind_turns(self.constellation, turns)
        self._see = bind_view(view, self.estimate, powered, turns)
        self._note = bind(
            note_ranges, block.t, block.kind, block.i, block.j, block.values, block.has_power,
            block.valid, view,
        )  # fmt: skip

    def __getstate__(self) -> dict[str, object]:
        """Return the state without the bound kernels; the owner must call `rebind` again."""
        bound = ("_wait", "_orient", "_follow", "_turn", "_see", "_note")
        return {k: v for k, v in self.__dict__.items() if k not in bound}
