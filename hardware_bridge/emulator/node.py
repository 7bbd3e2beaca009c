"""Emulated node: measurements to bytes of its formats, stamped by its own clock.

It depends on nothing of the group except the ids of others, and on nothing of the host.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hardware_bridge.decoders.base import Encoder
from hardware_bridge.emulator.boots import boot_numbers
from hardware_bridge.emulator.formats import WireFormat
from hardware_bridge.emulator.measured import Measured
from hardware_bridge.emulator.node_clock import NodeClock
from hardware_bridge.readings import (
    HeartbeatReading,
    ImuReading,
    PeerReading,
    RangeReading,
    Reading,
    Source,
    StateReading,
    StatusReading,
)
from tracking.measurements import ACCEL_NOISE, Kind

GRAVITY = 9.81
"""[m/s2] Specific force of a duplicate at rest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeParams:
    """Deviations of the devices from ideal ones."""

    drift_ppm: float = 20.0
    """[ppm] Standard deviation of the clocks' drift; crystals of such boards have 10 to 40 ppm."""
    most_offset: float = 600.0
    """[s] Longest time for which a device was on before the world began."""
    voltage: float = 3.9
    """[V] Reported battery voltage."""
    status_every: float = 1.0
    """[s] Period of heartbeats and voltage reports."""


class EmulatedNode:
    """A node with one or several ports, each with its own format.

    Invariants: equal rows, times and generator give equal bytes; a sample is stamped with its time
    of measurement, by the node's clock.
    """

    def __init__(
        self,
        node: int,
        formats: Sequence[WireFormat],
        ids: Sequence[int],
        rng: np.random.Generator,
        params: NodeParams,
    ) -> None:
        """Create a node that was switched on before the world began.

        Args:
            node: Id of the node.
            formats: Formats of its ports; a reading is sent in the first one that supports it.
            ids: Ids of all nodes, by index.
            rng: Generator of its clock and first boot number.
            params: Parameters of all nodes.
        """
        self.node, self.formats, self.params = node, tuple(formats), params
        self._ids, self._index = tuple(ids), tuple(ids).index(node)
        self.clock = NodeClock(
            float(rng.uniform(0.0, params.most_offset)),
            1e-6 * params.drift_ppm * float(rng.standard_normal()),
        )
        self._boots = boot_numbers(rng)
        self._silent_until = self._stuck_until = self._next_status = -np.inf
        self._start()

    def say(self, rows: Sequence[Measured], t: float) -> list[list[bytes]]:
        """Return the frames to send, in order, by port.

        Args:
            rows: Measurements since the last call.
            t: Current world time [s].
        """
        sent: list[list[bytes]] = [[] for _ in self.formats]
        for row in rows:
            reading = self._reading(row, t)
            if reading is not None and row.t >= self._silent_until:
                self._send(sent, reading, t if isinstance(reading, PeerReading) else row.t)
        if t >= max(self._silent_until, self._next_status):
            self._next_status = t + self.params.status_every
            self._send(sent, HeartbeatReading(Source()), t)
            self._send(sent, StatusReading(Source(), self.params.voltage), t)
        return sent

    def reboot(self, t: float, seconds: float) -> None:
        """Restart: silence for `seconds`, then the next boot number and a clock from 0."""
        self._silent_until = t + seconds
        self.clock.restart(t + seconds)
        self._start()

    def be_silent(self, until: float) -> None:
        """Send nothing until world time `until` [s]; measurements continue."""
        self._silent_until = max(self._silent_until, until)

    def stick(self, until: float) -> None:
        """Repeat the last IMU sample until world time `until` [s]."""
        self._stuck_until = until

    def _start(self) -> None:
        """Initialise the state of a boot."""
        self.boot = next(self._boots)
        self.sequences = [0] * len(self.formats)
        """Number of messages of this boot, by port."""
        self._encoders: list[Encoder] = [f.build(self.node, self.boot) for f in self.formats]
        self._next_status = -np.inf
        self._mag: tuple[float, float, float] | None = None
        self._sample: ImuReading | None = None

    def _reading(self, row: Measured, t: float) -> Reading | None:
        """Return a row in SI units; magnetometer values are added to the next IMU sample."""
        v, unnamed = row.values, Source()
        if row.kind is Kind.MAG:
            self._mag = v[0], v[1], v[2]
            return None
        if row.kind is Kind.STATE:
            q, accel = (v[0], v[1], v[2], v[3]), (v[4], v[5], v[6])
            if row.node != self._index:
                of = str(self._ids[row.node])
                return PeerReading(unnamed, of, t - row.t, q, accel, v[ACCEL_NOISE])
            return StateReading(unnamed, q, accel)
        if row.kind is Kind.RANGE:
            to = str(self._ids[row.other])
            rx_power, fp_power = (v[1], v[2]) if row.has_power else (None, None)
            nearer = None if row.node == self._index else str(self._ids[row.node])
            return RangeReading(unnamed, to, v[0], rx_power, fp_power, nearer)
        if self._sample is None or row.t >= self._stuck_until:
            gyr, acc = (v[0], v[1], v[2]), (v[3], v[4], v[5])
            self._sample = ImuReading(unnamed, gyr, acc, self._mag)
        self._mag = None
        return self._sample

    def _send(self, sent: list[list[bytes]], reading: Reading, t: float) -> None:
        """Encode a reading in the first format that supports it."""
        for port, wire in enumerate(self.formats):
            if type(reading) not in wire.says:
                continue
            ticks = None if wire.clock is None else self.clock.ticks(t, wire.clock)
            sequence = self.sequences[port]
            source = Source(wire.name_of(self.node), self.boot, sequence, ticks, wire.clock)
            self.sequences[port] = (sequence + 1) % (1 << 32)
            named = reading._replace(source=source)
            if isinstance(named, RangeReading):
                named = named._replace(to=wire.name_of(int(named.to)))
            readings: list[Reading] = [named]
            if wire.always_voltage and not isinstance(named, StatusReading):
                readings.append(StatusReading(source, self.params.voltage))
            frame = self._encoders[port].encode(readings)
            if frame:
                sent[port].append(frame)
            return


def at_rest(rows: Sequence[Measured]) -> list[Measured]:
    """Return the measurements of a duplicate: equal rows, but with an IMU at rest."""
    still = (0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY)
    return [row._replace(values=still) if row.kind is Kind.IMU else row for row in rows]
