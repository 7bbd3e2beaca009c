"""Input of the tracker: blocks of time-ordered measurements.

Simulator, log reader and live link make the same blocks, so estimates do not depend on the
source of measurements, nor on the division of events into blocks.
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
"""Number of leading columns that devices send; the tracker's orientation stage adds the rest."""
ACCEL_NOISE, AHRS_STATUS, UPRIGHT, GYRO_BIAS, GYRO_VAR = 7, 8, 9, 11, 14
"""Columns of a STATE event after orientation and acceleration, see `Kind`."""


class Kind(IntEnum):
    """Kinds of events, in the order in which events of one instant are handled.

    Each kind names its columns of `MeasurementBlock.values`.
    """

    JOIN = 0
    """Node i joins the group (its first range adds it, too)."""
    MAG = 1
    """Magnetic field of node i, body frame [uT]: x y z. Used with the next IMU sample."""
    IMU = 2
    """IMU sample of node i: gyroscope x y z [rad/s], specific force x y z [m/s2]."""
    STATE = 3
    """State of node i from its orientation filter: q_wb (w x y z); gravity-free accel_w x y z
    [m/s2]; added noise density of the acceleration [m/s2/sqrt(Hz)], 0 unless the sample is
    doubtful; AHRS feedback: 0 absent, 1 present as from the tracker's own orientations, 2 present
    and at rest. With feedback: accumulated tilt correction about world x and y [rad]; subtracted
    gyroscope bias, x y z in the body [rad/s]; its mean variance per axis [(rad/s)^2]."""
    SURVEY = 4
    """Surveyed distance between static nodes i and j [m]."""
    RANGE = 5
    """UWB range between i and j [m]; received and first-path power [dBm] if `has_power`."""
    LEAVE = 6
    """Node i leaves the group."""


@dataclass(frozen=True, slots=True)
class MeasurementBlock:
    """Events of one step, time-ordered in each environment.

    Properties: any division of the same events into blocks gives the same estimate;
    environment k of a block equals that environment alone, bit for bit.
    """

    __repr__ = short_repr

    t: F64
    """Time, (env, event) [s]."""
    kind: I64
    """A `Kind`, (env, event)."""
    i: I64
    """Node index, (env, event)."""
    j: I64
    """Other node index of a range or survey, (env, event); equal to `i` for the other kinds."""
    antenna_i: I64
    """Antenna index of node i in `Constellation.all_antennas`, (env, event)."""
    antenna_j: I64
    """Antenna index of node j, (env, event)."""
    values: F64
    """Measured values, (env, event, N_VALUES); columns as in `Kind`, the rest are 0."""
    has_power: Bool
    """True for ranges with powers, (env, event)."""
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
        """Fields in order, contiguous, for kernels that read; copied if necessary."""
        return tuple(np.ascontiguousarray(getattr(self, f.name)) for f in fields(self))

    @property
    def in_place(self) -> tuple[Any, ...]:
        """Fields in order, for kernels that write or are bound to the block.

        Raises:
            ConfigError: A field is not contiguous; kernels would work on a copy of it.
        """
        for f in fields(self):
            if not getattr(self, f.name).flags.c_contiguous:
                raise ConfigError(f"block: expected contiguous arrays, {f.name} is not")
        return self.arrays

    @classmethod
    def empty(cls, n_envs: int = 1, n_events: int = 0) -> MeasurementBlock:
        """Return a block of padding, to be filled."""
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
        """Return events of one kind in one environment.

        Args:
            kind: Kind of the events.
            t: Times, (event) [s].
            i: Node indices, (event).
            values: The columns that `kind` uses, (event, columns).
            j: Other node indices of ranges and surveys.
            antennas: Antenna indices of i and j of ranges and surveys. They count the antennas of
                all nodes; the default i and j assumes one antenna per node.
            has_power: True for ranges with powers.
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
        """Join blocks of the same environments in time."""
        parts = list(blocks)
        return cls(
            *(np.concatenate([getattr(b, f.name) for b in parts], axis=1) for f in fields(cls))
        )

    @classmethod
    def stack(cls, blocks: Iterable[MeasurementBlock]) -> MeasurementBlock:
        """Stack blocks of different environments, padded to the longest."""
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
        """Return the given event columns of every environment."""
        return MeasurementBlock(*(getattr(self, f.name)[:, events] for f in fields(self)))

    def env(self, k: int) -> MeasurementBlock:
        """Return environment k without its padding."""
        ok = self.valid[k]
        return MeasurementBlock(*(getattr(self, f.name)[k : k + 1, ok] for f in fields(self)))

    def order(self) -> I64:
        """Return the handling order: by time, kind, nodes, antennas, values; padding last."""
        first = (self.j, self.i, self.kind, self.t, ~self.valid)
        order: I64 = np.lexsort(first, axis=1)
        tied = np.take_along_axis(self.valid, order, axis=1)[:, 1:]
        for key in first:
            there = np.take_along_axis(key, order, axis=1)
            tied = tied & (there[:, 1:] == there[:, :-1])
        if tied.any():  # seldom, and takes several times as long
            rest = np.moveaxis(self.values[..., ::-1], -1, 0)
            order = np.lexsort((*rest, self.antenna_j, self.antenna_i, *first), axis=1)
        return order

    def sorted(self) -> MeasurementBlock:
        """Return the events in handling order."""
        rows, order = np.arange(self.n_envs)[:, None], self.order()
        return MeasurementBlock(*(getattr(self, f.name)[rows, order] for f in fields(self)))

    def count(self, kind: Kind) -> int:
        """Return the number of events of a kind over all environments."""
        return int(np.sum(self.valid & (self.kind == kind)))
