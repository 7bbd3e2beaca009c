"""From measurements to what every car sees, wherever they come from: simulation or hardware.

    block -> Horizon -> Tracker -> TeamEstimate -> AgentView

The tracker's estimate is as old as the horizon's delay and is carried to the present: positions
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
"""[m] The accuracy within which a pair is ok to those who act: the shipped policies learned so."""
FOR_POLICIES = FilterParams(joint=JointParams(accuracy=OK_WITHIN))
"""What the filters of a simulated or real swarm believe."""


class Perception:
    """Trackers of groups of cars, and what these see by them.

    Before a `step` its caller fills the block with what was measured since the last, `powered`,
    and of the view what is the car's own or comes from elsewhere: `now`, `present`, `speed`,
    `steering`, `near`.
    """

    def __init__(
        self,
        constellation: Constellation,
        params: TrackerParams,
        block: MeasurementBlock,
        powered: Bool,
        *,
        filter: str | FilterBuilder,
        room: int,
        n_beams: int = 0,
    ) -> None:
        """Make trackers that have heard nothing.

        Args:
            constellation: The nodes; the first of them ride on the cars, in the cars' order.
            params: What the trackers believe.
            block: Filled again by the caller before every step, in its own memory.
            powered: Which cars' trackers run, (env, car), likewise.
            filter: One of `tracking.filters.FILTERS`.
            room: Measurements that wait at a time, at most.
            n_beams: Of each car's distance sensors.
        """
        n_envs, n_cars = powered.shape
        self.constellation = constellation
        self.tracker = Tracker(constellation, params, filter=filter, n_envs=n_envs)
        self.horizon = Horizon(params.horizon, n_envs)
        self.horizon.reserve(room)
        self.view: AgentView = make_view(n_envs, n_cars, n_beams)
        self.estimate = TeamEstimate.empty(constellation, np.zeros(n_envs))
        """The tracker's last estimate, as old as the horizon, overwritten by the next."""
        self._room = room
        self.rebind(block, powered)

    def part(self, envs: slice, block: MeasurementBlock, powered: Bool) -> Perception:
        """Some of the groups; shares their memory.

        Args:
            envs: Which.
            block: As in the constructor, of these.
            powered: As in the constructor, of these.
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
        """Measurements that came later than the horizon waits, (env)."""
        return self.horizon.n_late

    @property
    def n_waiting(self) -> I64:
        """Measurements that wait in the horizon, (env)."""
        return self.horizon.state.n_waiting

    def share(self, target: F64, wanted: Bool, command: F64) -> None:
        """Let the view have what the task and the operator want, in their own memory.

        Args:
            target: As in `AgentView`.
            wanted: As in `AgentView`.
            command: As in `AgentView`.
        """
        self.view = self.view._replace(target=target, wanted=wanted, command=command)
        self.rebind(self._block, self._powered)

    def reset(self, env: int) -> None:
        """Forget everything of one environment."""
        self.tracker.reset(env)
        self.horizon.reset(env)
        forget_all(self.view, env)

    def make_room(self, room: int) -> None:
        """Let more measurements wait at a time; to be followed by `rebind`."""
        self.horizon.reserve(room)
        self._room = room

    def step(self) -> None:
        """Take the block in, let the trackers catch up, and see."""
        self._wait()
        self.estimate.t[:] = self.horizon.state.released
        self._orient()
        self._follow()
        self._turn()
        self._see()
        self._note()

    def rebind(self, block: MeasurementBlock, powered: Bool) -> None:
        """Put together what the kernels take: arrays that stay where they are.

        Args:
            block: As in the constructor.
            powered: As in the constructor.
        """
        self._block, self._powered = block, powered
        view = self.view
        due = MeasurementBlock.empty(len(view.now), self._room)
        self._wait = self.horizon.bind(block, view.now, due)
        self._orient, self._follow = self.tracker.bind(due, self.estimate)
        # Not every node rides on a car; those that do come first.
        turns = np.zeros((len(view.now), self.constellation.n_nodes))
        self._turn = self.horizon.bind_turns(self.constellation, turns)
        self._see = bind_view(view, self.estimate, powered, turns)
        self._note = bind(
            note_ranges, block.t, block.kind, block.i, block.j, block.values, block.has_power,
            block.valid, view,
        )  # fmt: skip

    def __getstate__(self) -> dict[str, object]:
        """What is put together by `rebind` stays behind; the owner calls it again."""
        bound = ("_wait", "_orient", "_follow", "_turn", "_see", "_note")
        return {k: v for k, v in self.__dict__.items() if k not in bound}
