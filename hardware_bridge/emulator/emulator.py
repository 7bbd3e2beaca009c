"""A simulated world behind devices: bytes to cars go in, bytes of nodes and cars come out.

    bytes to cars -> firmware -> World.step -> what was measured -> nodes -> faults -> ports

Pure but for the ports: time is an argument, and the same seeds and the same bytes to the cars
give the same bytes back.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from hardware_bridge.emulator.devices import CarDevice, NodeDevice, OperatorDevice
from hardware_bridge.emulator.fault_plan import CARS, LINKS, NODES, Fault, FaultPlan
from hardware_bridge.emulator.line import Line
from hardware_bridge.emulator.measured import by_node
from tracking.arrays import F64, Bool
from tracking.measurements import MeasurementBlock


class World(Protocol):
    """What the devices are in. Arrays over cars, in the order of the nodes."""

    @property
    def t(self) -> float:
        """Time since it began [s]."""

    @property
    def at_rest(self) -> bool:
        """True while the cars are held in place at first, and none is commanded to move."""

    @property
    def present(self) -> Bool:
        """Who is in the room, (car)."""

    @property
    def powered(self) -> Bool:
        """Which nodes have power, (car)."""

    @property
    def command(self) -> F64:
        """Velocity that the operator asks for, world frame, (car, 2) [m/s]."""

    def step(self, speed: F64, steering: F64) -> MeasurementBlock:
        """Go on by 10 ms.

        Args:
            speed: Asked of the motors, (car) [m/s].
            steering: Asked of the servos, (car) [rad].

        Returns:
            What was measured, of one environment.
        """

    def motion(self) -> tuple[F64, F64]:
        """Speeds by the cars' own wheels [m/s] and steering angles of their servos [rad], (car)."""

    def near(self) -> F64:
        """Distances by the cars' own sensors, (car, beam) [m]."""


class Emulator:
    """All devices of a group; it owns their lines."""

    def __init__(
        self,
        world: World,
        nodes: Sequence[NodeDevice],
        cars: Sequence[CarDevice],
        operator: OperatorDevice | None,
        plan: FaultPlan,
    ) -> None:
        """Put devices into a world.

        Args:
            world: Where they are.
            nodes: One a car, in the order of the world.
            cars: One a car, in the order of the world.
            operator: None for no remote control.
            plan: The script of what goes wrong; its chances are in the lines already.

        Raises:
            BridgeError: The script names what is not there.
        """
        self.world, self.nodes, self.cars, self.operator = world, nodes, cars, operator
        by_name: dict[str, NodeDevice | CarDevice | Line] = {
            **{f"{NODES}.{d.node.node}": d for d in nodes},
            **{f"{CARS}.{d.node.node}": c for d, c in zip(nodes, cars, strict=True)},
            **{f"{LINKS}.{line.name}": line for d in nodes for line in d.lines},
        }
        if operator is not None:
            by_name[f"{LINKS}.{operator.line.name}"] = operator.line
        self._by_name = by_name
        plan.check(list(by_name))
        self._script = [(f.t, k, f) for k, f in enumerate(plan.faults)]
        heapq.heapify(self._script)
        self.happened: list[Fault] = []
        """Faults of the script so far."""
        self._speed, self._steering = np.zeros((2, len(cars)))

    @property
    def lines(self) -> list[Line]:
        """All of them: of the nodes, of the cars, of the operator."""
        lines = [line for device in self.nodes for line in device.lines]
        lines += [car.line for car in self.cars]
        return lines + ([] if self.operator is None else [self.operator.line])

    def step(self, t_ns: int) -> MeasurementBlock:
        """Go on by 10 ms of the world.

        Args:
            t_ns: Now, of the host; never less than before.

        Returns:
            What was measured, faults or not; valid until the next step.
        """
        world = self.world
        while self._script and self._script[0][0] <= world.t:
            self._befall(heapq.heappop(self._script)[2], world.t)
        for k, car in enumerate(self.cars):
            wanted = car.listen(world.t, t_ns)
            self._speed[k], self._steering[k] = (0.0, 0.0) if world.at_rest else wanted
        block = world.step(self._speed, self._steering)
        t, powered = world.t, world.powered
        for k, (device, rows) in enumerate(
            zip(self.nodes, by_node(block, len(self.nodes)), strict=True)
        ):
            device.step(t, t_ns, rows, bool(powered[k]))
        for car, speed, steering, near in zip(
            self.cars, *world.motion(), world.near(), strict=True
        ):
            car.tell(t, t_ns, float(speed), float(steering), near.tolist())
        if self.operator is not None:
            self.operator.step(t, t_ns, world.command, world.present & (not world.at_rest))
        return block

    def listen(self, t_ns: int) -> bool:
        """Let the cars take what the host sends while the world stands; whether it sent anything.

        Args:
            t_ns: Now, of the host.
        """
        for car in self.cars:
            car.listen(self.world.t, t_ns)
        return any(car.heard for car in self.cars)

    def close(self) -> None:
        """Unplug everything."""
        for line in self.lines:
            line.close()

    def _befall(self, fault: Fault, t: float) -> None:
        """Let a fault of the script happen."""
        self.happened.append(fault)
        thing, until = self._by_name[fault.target], t + fault.seconds
        if fault.kind == "unplug":
            for line in [thing] if isinstance(thing, Line) else lines_of(thing):
                line.unplug(until)
        elif isinstance(thing, CarDevice):
            if fault.kind == "reboot":
                thing.reboot(t, fault.seconds)
            else:
                thing.be_silent(until)
        elif isinstance(thing, NodeDevice):
            _befall_node(thing, fault, t)


def lines_of(device: NodeDevice | CarDevice) -> list[Line]:
    """The lines of a device."""
    return [device.line] if isinstance(device, CarDevice) else list(device.lines)


def _befall_node(device: NodeDevice, fault: Fault, t: float) -> None:
    """What can happen to a node besides its plugs."""
    until = t + fault.seconds
    if fault.kind == "reboot":
        device.node.reboot(t, fault.seconds)
    elif fault.kind == "clock-step":
        device.node.clock.step(fault.seconds)
    elif fault.kind == "stuck-sensor":
        device.node.stick(until)
    elif fault.kind == "silence":
        device.node.be_silent(until)
    elif fault.kind == "twin":
        device.meet_twin(until)
