"""The one door into the tracker: blocks of time-ordered measurements.

A simulator, a log and a live link make the same blocks, so an estimate never depends on
where its measurements come from. How events are cut into blocks changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.errors import ConfigError
from tracking.params.short_repr import short_repr

N_VALUES = 16
"""Columns of `MeasurementBlock.values`."""
N_MEASURED = 8
"""The first of them: what devices send. The rest is told by the tracker's own orientations."""
ACCEL_NOISE, TOLD, UPRIGHT, GYRO_BIAS, GYRO_VAR = 7, 8, 9, 11, 14
"""Columns of a STATE event behind orientation and acceleration, see `Kind`."""


class Kind(IntEnum):
    """What an event is, in the order in which events of one instant are handled.

    The columns of `MeasurementBlock.values` that each kind uses are given with it.
    """

    JOIN = 0
    """Node i joins the group (it is also taken in when it is first heard)."""
    MAG = 1
    """Magnetic field of node i, body frame [uT]: x y z. Used with the next IMU sample."""
    IMU = 2
    """IMU sample of node i: gyroscope x y z [rad/s], specific force x y z [m/s2]."""
    STATE = 3
    """Node i's own orientation filter: q_wb (w x y z), gravity-free accel_w x y z [m/s2], then
    the noise density of the acceleration beyond that of its vehicle [m/s2/sqrt(Hz)], 0 unless the
    sample is doubted. Then 1 if the rest is reported, as the tracker's own
    orientations do, 2 if it is and the body rests: by how much it has been turned upright so far,
    about x and y of the world [rad]; the bias that is taken off its gyroscope, x y z in the body
    [rad/s], and the variance of that about one axis [(rad/s)^2]."""
    SURVEY = 4
    """Distance between static nodes i and j that was surveyed, not ranged [m]."""
    RANGE = 5
    """UWB range between i and j [m], then received and first-path power [dBm] if `has_power`."""
    LEAVE = 6
    """Node i leaves the group."""


@dataclass(frozen=True, slots=True)
class MeasurementBlock:
    """Events of one step, time-ordered in each environment.

    Laws: any split of the same events into blocks gives the same estimate; environment k of
    a block gives what that environment alone gives, bit for bit.
    """

    __repr__ = short_repr

    t: F64
    """Time, (env, event) [s]."""
    kind: I64
    """A `Kind`, (env, event)."""
    i: I64
    """Node index, (env, event)."""
    j: I64
    """Other node index of a range, (env, event); equal to `i` for the other kinds."""
    antenna_i: I64
    """Antenna index of node i in `Constellation.all_antennas`, (env, event)."""
    antenna_j: I64
    """Antenna index of node j, (env, event)."""
    values: F64
    """What was measured, (env, event, N_VALUES); columns as `Kind` says, the rest are 0."""
    has_power: Bool
    """True where a range came with its powers, (env, event)."""
    valid: Bool
    """False for padding, (env, event)."""

    @property
    def n_envs(self) -> int:
        """Number of environments."""
        return int(self.t.shape[0])

    @property
    def n_events(self) -> int:
        """Number of event columns, padding included."""
        return int(self.t.shape[1])

    @property
    def arrays(self) -> tuple[Any, ...]:
        """The fields in their order, contiguous, as kernels read them: copies where need be."""
        return tuple(np.ascontiguousarray(getattr(self, f.name)) for f in fields(self))

    @property
    def in_place(self) -> tuple[Any, ...]:
        """The fields in their order, as kernels take them that write, or are bound to the block.

        Raises:
            ConfigError: A field is not contiguous: kernels would work on a copy of it.
        """
        for f in fields(self):
            if not getattr(self, f.name).flags.c_contiguous:
                raise ConfigError(f"block: expected contiguous arrays, {f.name} is not")
        return self.arrays

    @classmethod
    def empty(cls, n_envs: int = 1, n_events: int = 0) -> MeasurementBlock:
        """A block of padding, to be filled."""
        shape = (n_envs, n_events)

        def ints() -> I64:
            return np.zeros(shape, dtype=np.int64)

        return cls(
            np.zeros(shape),
            ints(),
            ints(),
            ints(),
            ints(),
            ints(),
            np.zeros((*shape, N_VALUES)),
            np.zeros(shape, dtype=bool),
            np.zeros(shape, dtype=bool),
        )

    @classmethod
    def of_kind(
        cls,
        kind: Kind,
        t: F64,
        i: I64,
        values: F64,
        *,
        j: I64 | None = None,
        antennas: tuple[I64, I64] | None = None,
        has_power: Bool | None = None,
    ) -> MeasurementBlock:
        """Events of one kind in one environment.

        Args:
            kind: What they are.
            t: Times, (event) [s].
            i: Node indices, (event).
            values: The columns that `kind` uses, (event, columns).
            j: Other node indices, for ranges and surveys.
            antennas: Antenna indices of i and j, for these. They count the antennas of all nodes,
                so they are i and j, as assumed here, where every node has one.
            has_power: True where a range came with its powers.
        """
        block = cls.empty(1, len(t))
        block.t[0] = t
        block.kind[0] = kind
        block.i[0] = i
        block.j[0] = i if j is None else j
        if antennas is None and kind in (Kind.RANGE, Kind.SURVEY):
            antennas = block.i[0], block.j[0]
        if antennas is not None:
            block.antenna_i[0], block.antenna_j[0] = antennas
        block.values[0, :, : values.shape[1]] = values
        if has_power is not None:
            block.has_power[0] = has_power
        block.valid[0] = True
        return block

    @classmethod
    def concatenate(cls, blocks: Iterable[MeasurementBlock]) -> MeasurementBlock:
        """Blocks of the same environments, one after another."""
        parts = list(blocks)
        return cls(
            *(np.concatenate([getattr(b, f.name) for b in parts], axis=1) for f in fields(cls))
        )

    @classmethod
    def stack(cls, blocks: Iterable[MeasurementBlock]) -> MeasurementBlock:
        """Blocks of different environments, side by side, padded to the longest."""
        parts = list(blocks)
        n = max(b.n_events for b in parts)
        padded = [
            cls.concatenate([b, cls.empty(b.n_envs, n - b.n_events)]) if b.n_events < n else b
            for b in parts
        ]
        return cls(
            *(np.concatenate([getattr(b, f.name) for b in padded], axis=0) for f in fields(cls))
        )

    def take(self, events: slice | I64 | Bool) -> MeasurementBlock:
        """The given event columns of every environment."""
        return MeasurementBlock(*(getattr(self, f.name)[:, events] for f in fields(self)))

    def env(self, k: int) -> MeasurementBlock:
        """Environment k alone, without its padding."""
        ok = self.valid[k]
        return MeasurementBlock(*(getattr(self, f.name)[k : k + 1, ok] for f in fields(self)))

    def order(self) -> I64:
        """Event columns in handling order: by time, kind, nodes, antennas, values; padding last."""
        first = (self.j, self.i, self.kind, self.t, ~self.valid)
        order: I64 = np.lexsort(first, axis=1)
        tied = np.take_along_axis(self.valid, order, axis=1)[:, 1:]
        for key in first:
            there = np.take_along_axis(key, order, axis=1)
            tied = tied & (there[:, 1:] == there[:, :-1])
        if tied.any():  # seldom, and it takes several times as long
            rest = np.moveaxis(self.values[..., ::-1], -1, 0)
            order = np.lexsort((*rest, self.antenna_j, self.antenna_i, *first), axis=1)
        return order

    def sorted(self) -> MeasurementBlock:
        """The events in handling order."""
        rows, order = np.arange(self.n_envs)[:, None], self.order()
        return MeasurementBlock(*(getattr(self, f.name)[rows, order] for f in fields(self)))

    def count(self, kind: Kind) -> int:
        """Number of events of a kind over all environments."""
        return int(np.sum(self.valid & (self.kind == kind)))
