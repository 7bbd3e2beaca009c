"""Emulator: a simulated world behind devices that exchange bytes with the host.

    bytes to cars -> firmware -> World.step -> measurements -> nodes -> faults -> ports

Pure except for the ports: time is an argument, and equal seeds and equal bytes to the cars give
equal bytes back.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from hardware_bridge.emulator.devices import CarDevice, NodeDevice, OperatorDevice
from hardware_bridge.emulator.fault_plan import CARS, LINKS, NODES, Fault, FaultPlan
from hardware_bridge.emulator.line import Line
from hardware_bridge.emulator.measured import by_node, by_receiver
from tracking.arrays import F64, Bool
from tracking.measurements import MeasurementBlock


class World(Protocol):
    """World that contains the devices. Arrays over cars, in the order of the nodes."""

    @property
    def t(self) -> float:
        """Time since the start of the world [s]."""

    @property
    def at_rest(self) -> bool:
        """True during the initial standstill, in which no car is commanded to move."""

    @property
    def present(self) -> Bool:
        """True for cars in the room, (car)."""

    @property
    def powered(self) -> Bool:
        """True for cars whose node has power, (car)."""

    @property
    def command(self) -> F64:
        """Velocity commanded by the operator, world frame, (car, 2) [m/s]."""

    def step(self, speed: F64, steering: F64) -> MeasurementBlock:
        """Advance by 10 ms.

        Args:
            speed: Commanded speed, (car) [m/s].
            steering: Commanded steering angle, (car) [rad].

        Returns:
            Measurements of one environment.
        """

    def known(self) -> MeasurementBlock | None:
        """Return what each node knows from its radio, (node, event), see `by_receiver`.

        None if a range is known to the node that resolves it, and the motion of others is not.
        """

    def motion(self) -> tuple[F64, F64]:
        """Return the wheel speeds [m/s] and the steering angles of the servos [rad], (car)."""

    def near(self) -> F64:
        """Return the distances measured by the cars' own sensors, (car, sensor) [m]."""


class Emulator:
    """All devices of a group, and their lines."""

    def __init__(
        self,
        world: World,
        nodes: Sequence[NodeDevice],
        cars: Sequence[CarDevice],
        operator: OperatorDevice | None,
        plan: FaultPlan,
    ) -> None:
        """Connect devices to a world.

        Args:
            world: World that contains the devices.
            nodes: One per car, in the order of the world.
            cars: One per car, in the order of the world.
            operator: None for no remote control.
            plan: Its script is used; its frame faults are in the lines already.

        Raises:
            BridgeError: The script names an unknown device or line.
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
        """Faults of the script that have occurred."""
        self._speed, self._steering = np.zeros((2, len(cars)))

    @property
    def lines(self) -> list[Line]:
        """All lines: of the nodes, of the cars, of the operator."""
        lines = [line for device in self.nodes for line in device.lines]
        lines += [car.line for car in self.cars]
        return lines + ([] if self.operator is None else [self.operator.line])

    def step(self, t_ns: int) -> MeasurementBlock:
        """Advance the world by 10 ms.

        Args:
            t_ns: Current host time, non-decreasing.

        Returns:
            Measurements without faults; valid until the next step.
        """
        world = self.world
        while self._script and self._script[0][0] <= world.t:
            self._befall(heapq.heappop(self._script)[2], world.t)
        for k, car in enumerate(self.cars):
            commanded = car.listen(world.t, t_ns)
            self._speed[k], self._steering[k] = (0.0, 0.0) if world.at_rest else commanded
        block = world.step(self._speed, self._steering)
        t, powered, known = world.t, world.powered, world.known()
        measured = by_node(block, len(self.nodes))
        if known is not None:
            measured = by_receiver(measured, known)
        for k, (device, rows) in enumerate(zip(self.nodes, measured, strict=True)):
            device.step(t, t_ns, rows, bool(powered[k]))
        for car, speed, steering, near in zip(
            self.cars, *world.motion(), world.near(), strict=True
        ):
            car.tell(t, t_ns, float(speed), float(steering), near.tolist())
        if self.operator is not None:
            self.operator.step(t, t_ns, world.command, world.present & (not world.at_rest))
        return block

    def listen(self, t_ns: int) -> bool:
        """Process bytes of the host without a step of the world; return whether any have ever come.

        Args:
            t_ns: Current host time.
        """
        for car in self.cars:
            car.listen(self.world.t, t_ns)
        return any(car.received_any for car in self.cars)

    def close(self) -> None:
        """Unplug all lines."""
        for line in self.lines:
            line.close()

    def _befall(self, fault: Fault, t: float) -> None:
        """Apply a fault of the script."""
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
    """Return the lines of a device."""
    return [device.line] if isinstance(device, CarDevice) else list(device.lines)


def _befall_node(device: NodeDevice, fault: Fault, t: float) -> None:
    """Apply a fault other than ``unplug`` to a node."""
    until = t + fault.seconds
    if fault.kind == "reboot":
        device.node.reboot(t, fault.seconds)
    elif fault.kind == "clock-step":
        device.node.clock.step(fault.seconds)
    elif fault.kind == "stuck-sensor":
        device.node.stick(until)
    elif fault.kind == "silence":
        device.node.be_silent(until)
    elif fault.kind == "duplicate-id":
        device.add_duplicate(until)
