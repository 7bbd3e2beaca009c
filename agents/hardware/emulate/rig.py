"""An emulation with a step function: a world, its devices, and their ports in a folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.swarm_file import (
    OPERATOR_PORT,
    WRITTEN_BY,
    car_port,
    node_port,
    swarm_toml,
)
from agents.hardware.emulate.world import EmulatedWorld
from hardware_bridge.emulator.boots import boot_numbers
from hardware_bridge.emulator.cars import make_firmware
from hardware_bridge.emulator.cars.emulated_car import EmulatedCar
from hardware_bridge.emulator.devices import OPERATOR, CarDevice, NodeDevice, OperatorDevice
from hardware_bridge.emulator.emulator import Emulator
from hardware_bridge.emulator.faults import FaultInjector, FaultParams
from hardware_bridge.emulator.line import Line
from hardware_bridge.emulator.node import EmulatedNode
from hardware_bridge.emulator.ports import DevicePort, MemoryPort, PortBuilder
from hardware_bridge.emulator.pty import PtyPort
from hardware_bridge.errors import BridgeError
from hardware_bridge.safe_file import write_safely
from hardware_bridge.wire.encoder import RelposEncoder
from relpos_env.timing import DT
from tracking.log import Log
from tracking.measurements import MeasurementBlock

STEP_NS = round(1e9 * DT)
"""[ns] Length of a step."""
SWARM_FILE = "swarm.toml"
TRUTH_EVERY = 2
"""[-] Steps between two rows of truth in a log."""


class EmulatedRig:
    """World, devices and ports, stepped without waiting for real time.

    Property: equal options and equal bytes to cars at equal times give equal results, bit for bit.
    """

    def __init__(
        self,
        options: EmulateOptions,
        folder: Path | None = None,
        *,
        ports: PortBuilder | None = None,
        record: bool = False,
    ) -> None:
        """Create world, devices and ports, then write ``swarm.toml``.

        Args:
            options: Options of the emulation.
            folder: Folder for the ports and ``swarm.toml``, created if missing; None writes none.
            ports: Creates a port by its name; by default a pseudo terminal in the folder, or a
                line in memory without a folder.
            record: Whether to keep measurements and truth, see `EmulatedWorld.recording`.

        Raises:
            EnvError: An unknown name or a number out of range.
            BridgeError: An unknown device or option, or a port that cannot be created.
        """
        self.options = options
        self._formats = options.formats()
        self.world = EmulatedWorld(options.parts(), options.seed, record=record)
        self.constellation = self.world.swarm.constellation
        ids = self.constellation.ids
        for node in ids:
            make_firmware(options.driver, node, options.driver_options, self.options.car_key)
        # Symbolic links must not depend on the working directory.
        self.folder = None if folder is None else folder.resolve()
        if self.folder is not None:
            try:
                self.folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                why = error.strerror
                raise BridgeError(f"--out {folder}: cannot be made ({why})") from error
            _check_ours(self.folder / SWARM_FILE)
        self._make_port = ports or _ports_in(self.folder)
        self.ports: dict[str, DevicePort] = {}
        """Ports by name."""
        self._rng = np.random.default_rng([options.seed, _DEVICES])
        try:
            self.emulator = self._plug_in(ids)
        except BaseException:
            for port in self.ports.values():
                port.unplug()
            raise
        self._t_ns = 0
        if self.folder is not None:
            self._write(self.folder)

    def step(self, t_ns: int | None = None) -> MeasurementBlock:
        """Advance the world by 10 ms.

        Args:
            t_ns: Time of the host [ns]; by default 10 ms after the last step.

        Returns:
            Measurements without the effect of faults; valid until the next step.
        """
        self._t_ns = self._t_ns + STEP_NS if t_ns is None else t_ns
        return self.emulator.step(self._t_ns)

    def log(self, name: str) -> Log:
        """Return all measurements with the truth.

        Args:
            name: Name of the log.

        Raises:
            BridgeError: Measurements were not recorded.
        """
        recording, scenario = self.world.recording, self.world.parts.scenario.name
        if recording is None:
            raise BridgeError("record: expected an emulation that keeps measurements")
        return recording.to_log(name, scenario, self.constellation, truth_every=TRUTH_EVERY)

    def close(self) -> None:
        """Unplug all devices."""
        self.emulator.close()

    def swarm_toml(self, folder: Path, only: int | None = None) -> str:
        """Return the text of ``swarm.toml``.

        Args:
            folder: Folder of the ports.
            only: Node whose links and car are listed; None for all.
        """
        nodes = [(d.node, [line.name for line in d.lines]) for d in self.emulator.nodes]
        return swarm_toml(self.options, self.world.parts, self.constellation, nodes, folder, only)

    def _write(self, folder: Path) -> None:
        """Write ``swarm.toml`` atomically; with own trackers those of single cars instead."""
        files: dict[str, int | None] = {SWARM_FILE: None}
        if self.options.trackers == "own":
            # A host of the group would receive each range from several nodes.
            files = {f"swarm-{node}.toml": node for node in self.constellation.ids}
        for name, only in files.items():
            text = self.swarm_toml(folder, only)
            write_safely(folder / name, text, mode=0o644 if self.options.key is None else 0o600)
            # These devices are new: the replay protection of earlier ones with these ids is reset.
            (folder / name).with_suffix(".marks.json").unlink(missing_ok=True)

    def _plug_in(self, ids: tuple[int, ...]) -> Emulator:
        """Return an emulator with all devices on their lines."""
        options = self.options
        nodes = [self._node(k, ids) for k in range(len(ids))]
        cars = [self._car(node) for node in ids]
        operator = None
        if options.operator:
            boot = next(boot_numbers(self._rng))
            encoder = RelposEncoder(OPERATOR, boot, options.key)
            operator = OperatorDevice(self._line(OPERATOR_PORT, FaultParams()), encoder, boot, ids)
        return Emulator(self.world, nodes, cars, operator, options.faults)

    def _node(self, k: int, ids: tuple[int, ...]) -> NodeDevice:
        """Return the k-th node with its ports."""
        options = self.options
        names = [node_port(ids[k], p) for p in range(len(self._formats))]
        lines = [self._line(name, options.faults.frames) for name in names]
        own, other = self._rng.spawn(2)

        def make(rng: np.random.Generator) -> EmulatedNode:
            return EmulatedNode(ids[k], self._formats, ids, rng, options.nodes)

        return NodeDevice(make(own), lines, lambda: make(other))

    def _car(self, node: int) -> CarDevice:
        """Return the motor controller of a car with its line."""
        options, boots = self.options, boot_numbers(self._rng)

        def make() -> EmulatedCar:
            firmware = make_firmware(
                options.driver, node, options.driver_options, self.options.car_key, next(boots)
            )
            return EmulatedCar(firmware, options.deadman)

        line = self._line(car_port(node), FaultParams())
        return CarDevice(node, line, make, CAR_VOLTAGE)

    def _line(self, name: str, faults: FaultParams) -> Line:
        """Return a line: a port with a fault injector."""
        self.ports[name] = port = self._make_port(name)
        return Line(name, port, FaultInjector(faults, self._rng.spawn(1)[0]))


def _check_ours(path: Path) -> None:
    """Check that an existing file was written by an emulation and may be replaced.

    Raises:
        BridgeError: The file was not written by an emulation.
    """
    if not path.exists():
        return
    with path.open(encoding="utf-8", errors="replace") as stream:
        if stream.readline().rstrip("\n") != WRITTEN_BY:
            raise BridgeError(f"{path}: not written by an emulation, expected another --out")


_DEVICES = 0x0DE71CE5
"""Second entry of the seed of devices; the world is seeded with the seed alone."""
CAR_VOLTAGE = 7.6
"""[V] Voltage of a two-cell battery."""


def _ports_in(folder: Path | None) -> PortBuilder:
    """Return a builder of pseudo terminals in a folder, or of lines in memory without one."""
    if folder is None:
        return lambda name: MemoryPort()
    return lambda name: PtyPort(folder / name)
