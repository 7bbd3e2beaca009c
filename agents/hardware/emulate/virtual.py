"""A bridge under a virtual clock: emulated cars, trackers, gate and drivers in one process.

The bytes are those of `relpos emulate` and `relpos drive`, without ports, processes and real
time: the clock counts steps of 10 ms, and a drive takes as long as its computation.

Property: the same options and the same actions give the same results, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.rig import STEP_NS, EmulatedRig
from agents.hardware.emulate.swarm_file import car_port
from hardware_bridge.config import SwarmConfig, parse_config
from hardware_bridge.drivers import make_driver
from hardware_bridge.drivers.base import CarDriver
from hardware_bridge.emulator.ports import MemoryPort
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.feed import DECISION_NS
from hardware_bridge.live.opened import OpenBridge
from hardware_bridge.live.start import Start, StartParams
from hardware_bridge.live.swarm import LiveSwarm, load_calibration
from hardware_bridge.safety.charge import REPORT_EVERY
from hardware_bridge.safety.message_filter import MessageFilter
from hardware_bridge.safety.messages import Decision, Message, Notice, Order, Report, Word
from hardware_bridge.safety.picture import Picture
from hardware_bridge.safety.supervisor import Supervisor

START_NS = 1_000_000_000_000
"""[ns] Initial time of the clock; not 0, so that it cannot pass as a time since the start."""
LAG = 0.005
"""[s] Latency from the last input byte of a decision to its command bytes, as on a laptop."""
NOWHERE = Path("/virtual")
"""Placeholder for the folder of the ports."""


class VirtualFeed:
    """Emulated devices as an `OpenFeed`, which all advance together in steps of 10 ms."""

    def __init__(
        self, rig: EmulatedRig, swarm: LiveSwarm, *, arm: bool = True, lag: float = LAG
    ) -> None:
        """Connect devices and swarm.

        Args:
            rig: Devices with lines in memory.
            swarm: Swarm that receives the measurements.
            arm: Whether commands are sent to the cars; False is a dry run.
            lag: Latency of a decision [s].
        """
        self.rig, self._swarm, self._lag_ns = rig, swarm, round(1e9 * lag)
        self.t_ns = START_NS
        """[ns] Current time of the virtual clock."""
        config = swarm.config
        self._measuring = {link.port.name: _line(rig, link.name) for link in config.links}
        self._cars: dict[int, tuple[str, MemoryPort, CarDriver]] = {}
        """Name, port and driver of each car that receives commands, by slot."""
        for car in config.cars if arm else ():
            driver = make_driver(car.driver, car.node, car.options, car.key, 1, self._now_us)
            port = _line(rig, car_port(car.node))
            self._cars[config.slot_of(car)] = car.port.name, port, driver
        self._dry = () if arm else tuple(config.slot_of(car) for car in config.cars)
        drivers = {slot: driver for slot, (_, _, driver) in self._cars.items()}
        names = {slot: name for slot, (name, _, _) in self._cars.items()}
        self.supervisor = Supervisor(
            config.safety,
            config.n_slots,
            drivers,
            names,
            cells={config.slot_of(car): car.cells for car in config.cars},
            watchdog={config.slot_of(car): car.watchdog for car in config.cars if car.watchdog},
            message_filters={config.slot_of(car): MessageFilter(car, {}) for car in config.cars},
        )
        """Gate and drivers of the cars, read-only for observers."""
        self._up: set[int] = set()
        self._decided: tuple[int, Picture] | None = None
        self.report: Report | None = None
        self.notices: list[tuple[int, str]] = []
        self.n_late = 0
        self.attend: Callable[[], None] | None = None

    def advance(self) -> int:
        """Advance to the next decision; see `Feed`."""
        for _ in range(DECISION_NS // STEP_NS):
            self._step()
            if self.attend is not None:
                self.attend()
        self.notices += self._swarm.intake.notices
        self._swarm.intake.notices.clear()
        if self.report is not None:
            report = self.report
            self._swarm.apply(report.speed, report.steering, report.armed, report.reason)
        return self.t_ns

    def decide(self, picture: Picture) -> None:
        """Pass the picture to the gate after the latency; see `Feed`."""
        self._decided = self.t_ns + self._lag_ns, picture

    def order(self, what: str) -> None:
        """Execute an operator command; see `Order`."""
        if what == "gone":
            self._swarm.silent.dismiss()
        else:
            self._tell(Order(what))
        self.notices.append((self.t_ns, what))

    def note(self, t_ns: int, text: str) -> None:
        """Add a notice to the user."""
        self.notices.append((t_ns, text))

    def _step(self) -> None:
        """Advance by 10 ms: the world, its measurements, and the commands to the cars."""
        then = self.t_ns + STEP_NS
        if self._decided is not None and self._decided[0] <= then:
            self.t_ns, picture = self._decided
            self._decided = None
            self._tell(Decision(picture))
            self._act()
        self.t_ns = then
        self.rig.step(then)
        for name, port in self._measuring.items():
            self._receive(name, port)
        for slot, (name, port, _) in self._cars.items():
            if data := self._receive(name, port):
                self.supervisor.receive(slot, data, then * 1e-9)
        self._tell(Word(then * 1e-9, self._swarm.t_last_message()))
        self._act()
        if (then - START_NS) // STEP_NS % REPORT_EVERY == 0:
            self.report = self.supervisor.report()
            for _, port, driver in self._cars.values():
                port.send(driver.ask())

    def _receive(self, name: str, port: MemoryPort) -> bytes:
        data = port.receive()
        if data:
            self._swarm.take(Chunk(name, self.t_ns, data))
        return data

    def _act(self) -> None:
        """Send the commands of the supervisor to all cars."""
        up = {slot for slot, (_, port, _) in self._cars.items() if port.plugged}
        for slot in sorted(up - self._up):
            self._cars[slot][1].send(self._cars[slot][2].opening())
        self._up = up
        now = self.t_ns * 1e-9
        for slot, data in self.supervisor.tick(now, 0.0, [*self._dry, *sorted(up)]).items():
            self._cars[slot][1].send(data)
        self.supervisor.written(now, sorted(up))
        self._note(self.supervisor.stopped())

    def _tell(self, message: Message) -> None:
        self._note(self.supervisor.take(message))

    def _note(self, notices: list[Notice]) -> None:
        self.notices += [(self.t_ns, notice.text) for notice in notices]

    def _now_us(self) -> int:
        return self.t_ns // 1000


class VirtualBridge(OpenBridge):
    """Emulated cars under a virtual clock as an `OpenBridge`."""

    def __init__(
        self,
        options: EmulateOptions,
        *,
        arm: bool = True,
        wait: float = 60.0,
        lag: float = LAG,
        record: bool = False,
        ports: Callable[[str], MemoryPort] | None = None,
    ) -> None:
        """Create the devices and connect them.

        Args:
            options: Options of the emulation.
            arm: Whether the cars may move.
            wait: Longest wait until all checks pass and the cars are armed [s].
            lag: Latency of a decision [s].
            record: Whether to keep measurements and truth in ``rig.world.recording``.
            ports: Creates a line by its name, for example one that alters or records its bytes; by
                default a plain one. See `EmulatedRig.ports`.

        Raises:
            EnvError: An unknown name or a number out of range.
            BridgeError: An unknown device or option.
        """
        self.rig = EmulatedRig(options, ports=ports, record=record)
        text = self.rig.swarm_toml(NOWHERE)
        self.config: SwarmConfig = parse_config(text, file="swarm.toml", folder=NOWHERE)
        self.swarm = LiveSwarm(self.config, START_NS, load_calibration(self.config))
        self.feed = VirtualFeed(self.rig, self.swarm, arm=arm, lag=lag)
        self.start = Start(self.feed, arm=arm, params=StartParams(wait=wait))

    def close(self) -> None:
        """Unplug all devices."""
        self.rig.close()


def _line(rig: EmulatedRig, name: str) -> MemoryPort:
    port = rig.ports[name]
    assert isinstance(port, MemoryPort)
    return port
