"""Delayed horizon: late and out-of-order measurements become an ordered stream.

Measurements are held back for a fixed delay (100 ms in the paper, accumulated by its
upstream filters) and released in time order. A measurement that is later than the delay cannot
be put in order: it is dropped and counted.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tracking.arrays import F64, I64
from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.kernels.jit import bind
from tracking.late_data.queue import N_COLUMNS, count_due, hand_on, sum_turns, take_in
from tracking.measurements import Kind, MeasurementBlock
from tracking.params.checks import check_numbers

LONG_BLOCK = 4096
"""[-] Longest block that is queued without being sorted first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HorizonParams:
    """Delay of the horizon."""

    delay: float = 0.1
    """[s] Delay of measurements; a longer one orders later ones and makes all estimates older."""

    def __post_init__(self) -> None:
        check_numbers(self, may_be_zero=("delay",))


class HorizonState(NamedTuple):
    """Queued measurements, and counters."""

    slots: F64
    """Events, in the columns of `late_data.queue`, (env, slot, N_COLUMNS)."""
    order: I64
    """Slots: queued ones in order, then free ones, (env, slot)."""
    n_waiting: I64
    """Number of queued events, (env)."""
    released: F64
    """Time up to which measurements were released, (env) [s]."""
    n_late: I64
    """Number of measurements dropped as too late, (env)."""
    n_doubled: I64
    """Number of measurements dropped as duplicates, (env)."""

    def of(self, envs: slice) -> HorizonState:
        """Return some environments, as views."""
        views: list[Any] = [array[envs] for array in self]
        return HorizonState(*views)


def make_state(n_envs: int, n_slots: int = 64) -> HorizonState:
    """Return an empty queue."""

    def ints(*shape: int) -> I64:
        return np.zeros((n_envs, *shape), dtype=np.int64)

    return HorizonState(
        slots=np.zeros((n_envs, n_slots, N_COLUMNS)),
        order=np.tile(np.arange(n_slots), (n_envs, 1)),
        n_waiting=ints(),
        released=np.full(n_envs, -np.inf),
        n_late=ints(),
        n_doubled=ints(),
    )


class Horizon:
    """A reordering buffer upstream of the tracker.

    Properties: the output does not depend on the order or the blocks in which measurements arrive,
    as long as none is later than the delay; environment k of a batch equals that environment
    alone.

    The class wraps `take_in` and `hand_on`, which work on slices of environments too
    (`HorizonState.of`), once there is room (`reserve`).
    """

    def __init__(self, params: HorizonParams, n_envs: int = 1) -> None:
        self._params = params
        self._n_envs = n_envs
        self._whole: tuple[Horizon, HorizonState] | None = None
        """For a part: the whole horizon, and the memory that it shared."""
        self.state = make_state(n_envs)
        """Queue, arrays over (env, ...)."""

    @property
    def waiting(self) -> MeasurementBlock:
        """Copy of the measurements that are still queued, in order."""
        self._check_memory(self.state)
        out = MeasurementBlock.empty(self._n_envs, int(self.state.n_waiting.max(initial=0)))
        hand_on(self.state, np.full(self._n_envs, np.inf), False, out.arrays)
        return out

    @property
    def t(self) -> F64:
        """Time up to which measurements were released, (env) [s]."""
        self._check_memory(self.state)
        return self.state.released.copy()

    @property
    def n_late(self) -> I64:
        """Number of measurements dropped as too late, (env)."""
        return self.state.n_late

    @property
    def n_doubled(self) -> I64:
        """Number of measurements dropped as duplicates, (env)."""
        return self.state.n_doubled

    def step(
        self, block: MeasurementBlock, now: F64 | float, out: MeasurementBlock | None = None
    ) -> MeasurementBlock:
        """Queue new measurements and release, in order, those older than the delay.

        Args:
            block: Measurements that arrived, in any order.
            now: Current time, scalar or (env) [s]; must not decrease.
            out: A block to write into, which saves an allocation; it may be longer than needed.

        Returns:
            The measurements up to ``now - delay``, sorted; `out` if given.

        Raises:
            ConfigError: More measurements are due than `out` has columns; they stay queued. Or
                this is a part, and they do not fit, or the whole was reallocated since.
        """
        self._check_memory(self.state)
        until = np.broadcast_to(np.asarray(now, dtype=np.float64), (self._n_envs,))
        if block.n_events > LONG_BLOCK:
            block = block.sorted()
        if self._room < block.n_events:
            self.reserve(int(block.valid.sum(axis=1).max(initial=0)))
        take_in(self.state, block.arrays)
        return self._release(until - self._params.delay, out)

    def bind(self, block: MeasurementBlock, now: F64, out: MeasurementBlock) -> Callable[[], None]:
        """Bind `step` to fixed arrays, without its overhead.

        Args:
            block: Refilled before every call.
            now: Current times, (env) [s], refilled before every call.
            out: Written by every call.

        Returns:
            A function that makes a step; it raises ConfigError if there is not room enough, or if
            the queue was reallocated since (`reserve`).
        """
        state, until, delay = self.state, np.empty_like(now), self._params.delay
        take = bind(take_in, state, block.in_place)
        count = bind(count_due, state, until)
        give = bind(hand_on, state, until, True, out.in_place)

        def step() -> None:
            self._check_memory(state)
            np.subtract(now, delay, until)
            if take() or count() > out.n_events:
                raise ConfigError(
                    f"horizon: {state.order.shape[1]} measurements that wait and {out.n_events} "
                    "that are due are not room enough"
                )
            give()

        return step

    def bind_turns(self, constellation: Constellation, out: F64) -> Callable[[], None]:
        """Return a function that integrates the yaw rates of the queued samples.

        Estimates are as old as the delay; for nodes that stay level, this rotation brings their
        headings to the present.

        Args:
            constellation: Nodes, with the rates of their IMUs.
            out: Rotation about the own vertical, (env, node) [rad], written by every call.
        """
        dt = np.array([1.0 / node.imu_hz for node in constellation.nodes])
        return bind(sum_turns, self.state, int(Kind.IMU), dt, out)

    def part(self, envs: slice) -> Horizon:
        """Return some of the environments; shares their memory, and keeps its present capacity."""
        part = copy.copy(self)
        part.state = self.state.of(envs)
        part._n_envs, part._whole = len(part.state.n_waiting), self._whole or (self, self.state)
        return part

    def flush(self) -> MeasurementBlock:
        """Release all queued measurements at the end of a stream, which may continue after that."""
        self._check_memory(self.state)
        before = self.state.released.copy()
        out = self._release(np.full(self._n_envs, np.inf), None)
        last = np.where(out.valid, out.t, -np.inf).max(axis=1, initial=-np.inf)
        np.maximum(before, last, out=self.state.released)
        return out

    def reset(self, env: int) -> None:
        """Clear the queue of one environment."""
        self._check_memory(self.state)
        state = self.state
        state.n_waiting[env] = state.n_late[env] = state.n_doubled[env] = 0
        state.released[env] = -np.inf

    def _check_memory(self, state: HorizonState) -> None:
        """Raise an error if kernels would use arrays that were reallocated."""
        whole, shared = self._whole or (self, state)
        if self.state is not state or whole.state is not shared:
            raise ConfigError("horizon: room was made since; bind it, or take its part, again")

    @property
    def _room(self) -> int:
        """Number of free slots in the fullest environment."""
        return int(self.state.order.shape[1] - self.state.n_waiting.max(initial=0))

    def reserve(self, n_events: int) -> None:
        """Make room for `n_events` more events in every environment."""
        old = self.state.order.shape[1]
        needed = int(self.state.n_waiting.max(initial=0)) + n_events
        if needed <= old:
            return
        if self._whole is not None:
            raise ConfigError(f"horizon: a part has room for {old} measurements, needs {needed}")
        # At least twice as many: frequent growth must not reallocate each time.
        grown = make_state(self._n_envs, max(needed, 2 * old))
        for name in HorizonState._fields:
            array, before = getattr(grown, name), getattr(self.state, name)
            array[(slice(None), slice(old), ...)[: array.ndim]] = before
        self.state = grown

    def _release(self, until: F64, out: MeasurementBlock | None) -> MeasurementBlock:
        n = int(count_due(self.state, until))
        if out is None:
            out = MeasurementBlock.empty(self._n_envs, n)
        elif out.n_events < n:
            raise ConfigError(f"out: expected at least {n} event columns, got {out.n_events}")
        hand_on(self.state, until, True, out.in_place)
        return out
