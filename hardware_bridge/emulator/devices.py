"""Devices and their lines: nodes, cars, and the operator's remote control."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from hardware_bridge.decoders.base import Encoder
from hardware_bridge.emulator.cars.emulated_car import EmulatedCar
from hardware_bridge.emulator.line import Line
from hardware_bridge.emulator.measured import Measured
from hardware_bridge.emulator.node import EmulatedNode, at_rest
from hardware_bridge.emulator.node_clock import NodeClock
from hardware_bridge.readings import (
    MICROSECONDS_32,
    MotionReading,
    NearReading,
    OperatorReading,
    Reading,
    Source,
    StatusReading,
)
from relpos_env.interface.rangefinders import FARTHEST
from tracking.arrays import F64, Bool

TELEMETRY_EVERY = 0.02
"""[s] Period of a car's motion telemetry."""
STATUS_EVERY = 1.0
"""[s] Period of a car's battery reports."""
OPERATOR_EVERY = 0.1
"""[s] Period of the operator's messages to each car."""
OPERATOR = 0xFFFE
"""Id of the remote control, the highest of our format."""
SOON = 1e-6
"""[s] Actions that are due within this time are run now, to absorb rounding errors."""


def next_multiple(t: float, every: float) -> float:
    """Return the first multiple of `every` after `t`, which keeps the phase of the messages."""
    return (math.floor((t + SOON) / every) + 1) * every


class NodeDevice:
    """A node with its lines, and temporarily a duplicate: a second device with the same id."""

    def __init__(
        self, node: EmulatedNode, lines: Sequence[Line], make_duplicate: Callable[[], EmulatedNode]
    ) -> None:
        self.node, self.lines = node, tuple(lines)
        self._make_duplicate = make_duplicate
        self._duplicate: EmulatedNode | None = None
        self._duplicate_until = -np.inf
        self._powered = True

    def step(self, t: float, t_ns: int, rows: Sequence[Measured], powered: bool) -> None:
        """Send measurements.

        Args:
            t: Current world time [s].
            t_ns: Current host time.
            rows: Measurements since the last step.
            powered: True if the node has power; it restarts when power returns.
        """
        if powered and not self._powered:
            self.node.reboot(t, 0.0)
        self._powered = powered
        frames: list[list[bytes]] = [[] for _ in self.lines]
        if powered:
            frames = self.node.say(rows, t)
        if self._duplicate is not None and t < self._duplicate_until:
            for own, other in zip(frames, self._duplicate.say(at_rest(rows), t), strict=True):
                own += other
        for line, sent in zip(self.lines, frames, strict=True):
            line.replug_if_due(t)
            line.send(t_ns, sent)

    def add_duplicate(self, until: float) -> None:
        """Add a second device with the same id to the lines until world time `until` [s]."""
        self._duplicate, self._duplicate_until = self._make_duplicate(), until


class CarDevice:
    """A car's controller with its line."""

    def __init__(
        self, node: int, line: Line, make_car: Callable[[], EmulatedCar], voltage: float
    ) -> None:
        """Create a running controller.

        Args:
            node: Id of the car's node.
            line: Line of the controller.
            make_car: Factory of a controller in its state after a start.
            voltage: Battery voltage [V].
        """
        self.node, self.line = node, line
        self._make, self._car = make_car, make_car()
        self._voltage = voltage
        self._clock = NodeClock()
        self._off_until = self._silent_until = -np.inf
        self._next = self._next_status = 0.0
        self.received_any = False
        """True once the host has sent anything."""

    def listen(self, t: float, t_ns: int) -> tuple[float, float]:
        """Process bytes of the host; return the commanded speed [m/s] and steering angle [rad]."""
        self.line.replug_if_due(t)
        data = self.line.port.read()
        self.received_any |= bool(data)
        if t < self._off_until:
            return 0.0, 0.0
        if data:
            self._car.feed(t_ns, data)
        return self._car.command(t_ns)

    def tell(
        self, t: float, t_ns: int, speed: float, steering: float, near: Sequence[float] = ()
    ) -> None:
        """Send the telemetry that is due.

        Args:
            t: Current world time [s].
            t_ns: Current host time.
            speed: Wheel speed [m/s].
            steering: Angle of the front wheels [rad].
            near: Distances of its sensors, evenly spaced around it, the first ahead [m].
        """
        frame = b""
        if t + SOON >= max(self._off_until, self._silent_until, self._next):
            self._next = next_multiple(t, TELEMETRY_EVERY)
            ticks = self._clock.ticks(t, MICROSECONDS_32)
            source = Source(device=str(self.node), ticks=ticks, clock=MICROSECONDS_32)
            readings: list[Reading] = [MotionReading(source, speed, steering)]
            turn = 2.0 * math.pi / max(len(near), 1)
            readings += [
                NearReading(source, k * turn, distance if distance < FARTHEST else None)
                for k, distance in enumerate(near)
            ]
            if t + SOON >= self._next_status:
                self._next_status = t + STATUS_EVERY
                readings.append(StatusReading(source, self._voltage))
            frame = self._car.encode(readings)
        self.line.send(t_ns, [frame] if frame else ())

    def reboot(self, t: float, seconds: float) -> None:
        """Restart without state; stop, ignore commands and send nothing for `seconds`."""
        self._car, self._off_until = self._make(), t + seconds
        self._clock.restart(t + seconds)

    def be_silent(self, until: float) -> None:
        """Send nothing until world time `until` [s]; commands are still executed."""
        self._silent_until = until


class OperatorDevice:
    """Receiver of the operator's remote control."""

    def __init__(self, line: Line, encoder: Encoder, boot: int, cars: Sequence[int]) -> None:
        """Create a receiver.

        Args:
            line: Line of the receiver.
            encoder: Encoder of our format.
            boot: Boot number of the receiver.
            cars: Node ids of the cars, by index.
        """
        self.line = line
        self._encoder, self._boot, self._cars = encoder, boot, tuple(cars)
        self._clock, self._sequence, self._next = NodeClock(), 0, 0.0

    def step(self, t: float, t_ns: int, velocity: F64, present: Bool) -> None:
        """Send the operator's velocity to every present car, if it is due.

        Args:
            t: Current world time [s].
            t_ns: Current host time.
            velocity: Commanded velocity, world frame, (car, 2) [m/s].
            present: True for cars in the room, (car).
        """
        self.line.replug_if_due(t)
        if t + SOON < self._next:
            self.line.send(t_ns, ())
            return
        self._next = next_multiple(t, OPERATOR_EVERY)
        ticks, frames = self._clock.ticks(t, MICROSECONDS_32), []
        for k in np.flatnonzero(present).tolist():
            source = Source(str(OPERATOR), self._boot, self._sequence, ticks, MICROSECONDS_32)
            self._sequence = (self._sequence + 1) % (1 << 32)
            requested = (float(velocity[k, 0]), float(velocity[k, 1]))
            reading = OperatorReading(source, str(self._cars[k]), requested)
            frames.append(self._encoder.encode([reading]))
        self.line.send(t_ns, frames)
