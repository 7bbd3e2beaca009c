"""What every car knows by itself: its own inertial samples, and what its radio received.

block -> Orientation of every car -> sums of motion -> messages -> events of every car
"""

from __future__ import annotations

import copy
from typing import NamedTuple

import numpy as np

from relpos_env.interface._own_kernels import share_events
from tracking.ahrs.orientation import Orientation
from tracking.ahrs.params import OrientationParams
from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.kernels.jit import bind
from tracking.measurements import MeasurementBlock
from tracking.ranging.compiled.motion import make_received, make_senders
from tracking.ranging.compiled.overheard import Overheard
from tracking.records import Records, as_records


class Events(NamedTuple):
    """Events as in `MeasurementBlock`, in place; (row, slot)."""

    t: F64
    kind: I64
    i: I64
    j: I64
    antenna_i: I64
    antenna_j: I64
    values: F64
    has_power: Bool
    valid: Bool
    used: I64
    """Number of events, (row)."""


class OwnEvents:
    """Events of every car of every group: states of itself and of others, ranges."""

    def __init__(
        self,
        constellation: Constellation,
        params: OrientationParams,
        block: MeasurementBlock,
        powered: Bool,
        overheard: Overheard,
        *,
        follows_bias: bool,
    ) -> None:
        """Create an exchange without messages.

        Args:
            constellation: Nodes, all on cars, in the cars' order.
            params: Parameters of the orientation stage.
            block: Measurements, updated in place by the caller before every step. Of them a car
                knows the inertial samples of its own; ranges are in `overheard`.
            powered: True where the car's tracker runs, (env, car), updated in place as well.
            overheard: What each car knows from its radio, updated in place as well.
            follows_bias: True if the filter uses the feedback of the orientation stage.
        """
        n_envs, n_cars = powered.shape
        self._orientation = Orientation(constellation, params, n_envs, follows_bias=follows_bias)
        self._senders: Records = make_senders(n_envs, n_cars)
        self._received: Records = make_received(n_envs, n_cars)
        self.headings: F64 = np.zeros((n_envs, n_cars))
        """Heading by the last state of every car, (env, car) [rad]."""
        self.rebind(block, powered, overheard)

    def part(
        self, envs: slice, block: MeasurementBlock, powered: Bool, overheard: Overheard
    ) -> OwnEvents:
        """Return the part for some environments; it shares memory with the whole."""
        part = copy.copy(self)
        part._orientation = self._orientation.part(envs)
        part._senders, part._received = self._senders[envs], self._received[envs]
        part.headings = self.headings[envs]
        part.rebind(block, powered, overheard)
        return part

    def reset(self, env: int) -> None:
        """Forget one environment."""
        self._orientation.reset(env)
        self._senders[env], self._received[env] = 0, 0

    def switch_on(self, env: int, car: int) -> None:
        """Forget what a car received; its sums start again."""
        self._received[env, car] = 0
        self._overheard.last[env, car] = 0
        self._senders["running"][env, car] = False

    def step(self) -> None:
        """Write the events of the block and of the receptions since the last step."""
        # A copy: the orientation stage replaces samples by states, in place.
        for target, source in zip(self._states.arrays, self._block.arrays, strict=True):
            np.copyto(target, source)
        self._orient()
        self._distribute()

    def rebind(self, block: MeasurementBlock, powered: Bool, overheard: Overheard) -> None:
        """Bind the kernels to their arrays; arguments as in the constructor."""
        self._block, self._overheard = block, overheard
        # Own samples, members, and two states or a range for each reception.
        (n_envs, n), rows = powered.shape, powered.size
        slots = block.n_events // n + 4 * n + 3 * overheard.t.shape[1] // n
        self.block = MeasurementBlock.empty(rows, slots)
        """Events of every car, (env car, slot), in the order in which it knows them."""
        self.events = Events._make((*self.block.in_place, np.zeros(rows, dtype=np.int64)))
        """The same, with the number of events."""
        self._states = MeasurementBlock.empty(n_envs, block.n_events)
        self._orient = self._orientation.bind(self._states)
        self._distribute = bind(
            share_events, Events._make((*self._states.in_place, np.zeros(n_envs, dtype=np.int64))),
            overheard, as_records(self._senders), as_records(self._received), self.headings,
            powered, self.events,
        )  # fmt: skip

    def __getstate__(self) -> dict[str, object]:
        """Return the state without the bound kernels; the owner must call `rebind` again."""
        return {k: v for k, v in self.__dict__.items() if k not in ("_orient", "_distribute")}
