"""Devices on their lines: nodes, cars, and the operator's remote control."""

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
from relpos_env.interface.beams import FARTHEST
from tracking.arrays import F64, Bool

TELEMETRY_EVERY = 0.02
"""[s] Between two readings that a car sends of its own motion."""
STATUS_EVERY = 1.0
"""[s] Between two of its battery."""
OPERATOR_EVERY = 0.1
"""[s] Between two messages of the operator to each car."""
OPERATOR = 0xFFFE
"""The remote control's own id; the last one of our format."""
SOON = 1e-6
"""[s] What is due so soon is done now, for the roundings of times."""


def next_multiple(t: float, every: float) -> float:
    """The first whole multiple of `every` after `t`, so that what is seldom keeps its beat."""
    return (math.floor((t + SOON) / every) + 1) * every


class NodeDevice:
    """A node with its lines, and its twin while there is one."""

    def __init__(
        self, node: EmulatedNode, lines: Sequence[Line], make_twin: Callable[[], EmulatedNode]
    ) -> None:
        self.node, self.lines = node, tuple(lines)
        self._make_twin = make_twin
        self._twin: EmulatedNode | None = None
        self._twin_until = -np.inf
        self._powered = True

    def step(self, t: float, t_ns: int, rows: Sequence[Measured], powered: bool) -> None:
        """Send what was measured.

        Args:
            t: Now, of the world [s].
            t_ns: Now, of the host.
            rows: Since the last step.
            powered: Whether the node has power; it starts again when that comes back.
        """
        if powered and not self._powered:
            self.node.reboot(t, 0.0)
        self._powered = powered
        frames: list[list[bytes]] = [[] for _ in self.lines]
        if powered:
            frames = self.node.say(rows, t)
        if self._twin is not None and t < self._twin_until:
            for own, other in zip(frames, self._twin.say(at_rest(rows), t), strict=True):
                own += other
        for line, sent in zip(self.lines, frames, strict=True):
            line.replug_if_due(t)
            line.send(t_ns, sent)

    def meet_twin(self, until: float) -> None:
        """Another device under the same id speaks on the same lines."""
        self._twin, self._twin_until = self._make_twin(), until


class CarDevice:
    """A car's controller on its line."""

    def __init__(
        self, node: int, line: Line, make_car: Callable[[], EmulatedCar], voltage: float
    ) -> None:
        """Switch it on.

        Args:
            node: Its id.
            line: Its own.
            make_car: The controller as after a start.
            voltage: Of its battery [V].
        """
        self.node, self.line = node, line
        self._make, self._car = make_car, make_car()
        self._voltage = voltage
        self._clock = NodeClock()
        self._off_until = self._silent_until = -np.inf
        self._next = self._next_status = 0.0
        self.heard = False
        """True once the host has sent anything."""

    def listen(self, t: float, t_ns: int) -> tuple[float, float]:
        """Take what the host sent; give speed [m/s] and steering angle [rad] of now."""
        self.line.replug_if_due(t)
        data = self.line.port.read()
        self.heard |= bool(data)
        if t < self._off_until:
            return 0.0, 0.0
        if data:
            self._car.feed(t_ns, data)
        return self._car.command(t_ns)

    def tell(
        self, t: float, t_ns: int, speed: float, steering: float, near: Sequence[float] = ()
    ) -> None:
        """Send what it says of its own motion, as often as it does.

        Args:
            t: Now, of the world [s].
            t_ns: Now, of the host.
            speed: By its own wheels [m/s].
            steering: Of its front wheels [rad].
            near: By its distance sensors, evenly round it, the first ahead [m].
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
        """Stop, forget everything, be deaf and silent for so long."""
        self._car, self._off_until = self._make(), t + seconds
        self._clock.restart(t + seconds)

    def be_silent(self, until: float) -> None:
        """Drive on and say nothing."""
        self._silent_until = until


class OperatorDevice:
    """The receiver of the operator's remote control."""

    def __init__(self, line: Line, encoder: Encoder, boot: int, cars: Sequence[int]) -> None:
        """Put it on its line.

        Args:
            line: Its own.
            encoder: Of our format.
            boot: Its boot number.
            cars: Node ids of the cars, by index.
        """
        self.line = line
        self._encoder, self._boot, self._cars = encoder, boot, tuple(cars)
        self._clock, self._sequence, self._next = NodeClock(), 0, 0.0

    def step(self, t: float, t_ns: int, velocity: F64, present: Bool) -> None:
        """Tell every car what the operator wants, as often as he does.

        Args:
            t: Now, of the world [s].
            t_ns: Now, of the host.
            velocity: World frame, (car, 2) [m/s].
            present: Who is in the room, (car).
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
            wanted = (float(velocity[k, 0]), float(velocity[k, 1]))
            reading = OperatorReading(source, str(self._cars[k]), wanted)
            frames.append(self._encoder.encode([reading]))
        self.line.send(t_ns, frames)
