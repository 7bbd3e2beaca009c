"""Checked content of swarm.toml."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from hardware_bridge.external_tracker.params import ReadyParams
from hardware_bridge.ingest.scanner import ScannerMount
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.safety.params import SafetyParams
from tracking.constellation import Constellation
from tracking.filters import DEFAULT_FILTER


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkConfig:
    """A link with measurements."""

    name: str
    port: PortSpec
    format: str
    """Format, a key of `hardware_bridge.decoders.DECODERS`."""
    node: int | None = None
    """Sender, for formats that do not name it."""
    ids: Mapping[str, int] = field(default_factory=dict)
    """Node by device id as in `Source.device`."""
    key: bytes | None = None
    """Key of the MAC, 16 bytes; None accepts messages without one."""
    scanner: ScannerMount | None = None
    """Mounting position of the scanner on its car, if the link is a scanner's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CarConfig:
    """A car that can be driven."""

    node: int
    """Node that is mounted on the car."""
    port: PortSpec
    driver: str
    """Driver, a key of `hardware_bridge.drivers.DRIVERS`."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the driver."""
    key: bytes | None = None
    """Key of the MAC, 16 bytes; None for messages without one."""
    watchdog: float | None = None
    """[s] Time without messages after which the car stops by itself, as measured by `relpos doctor
    --watchdog`; None if not measured, which is refused for cars that move."""
    cells: int = 0
    """[-] Number of battery cells in series, to check the voltage; 0 disables the check."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskConfig:
    """Task of the cars."""

    name: str = "hold"
    """Task, a key of `relpos_env.tasks.TASKS`."""
    room: tuple[float, float] = (6.0, 6.0)
    """[m] Width and depth of the floor that the task may use, around the start of the group."""
    command: Literal["plan", "link"] = "plan"
    """Source of the commanded velocity: the plan alone, or the messages of an operator on a link,
    who sees the room."""
    proximity: int = 0
    """[-] Number of distance sensors around each car, for policies that observe them."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the task."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerConfig:
    """Settings of the tracker."""

    source: Literal["measurements", "positions"] = "measurements"
    """Source of positions: our tracker from measurements, or an external tracker."""
    filter: str = DEFAULT_FILTER
    """Filter, a key of `tracking.filters.FILTERS`."""
    delay: float = 0.1
    """[s] Time that measurements are held back for earlier ones that arrive later."""
    accuracy: float | None = None
    """[m] Expected error up to which a pair is ok, 0.01 to 10; left out, 0.3 with a car and 0.5
    without."""
    positions: ReadyParams = ReadyParams()
    """Parameters of external positions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SwarmConfig:
    """A group of real nodes and cars."""

    name: str
    constellation: Constellation
    """Nodes, moving ones first: each moving node is a slot of the environment, car or not."""
    links: tuple[LinkConfig, ...]
    cars: tuple[CarConfig, ...]
    """Cars in the order of their nodes."""
    calibration: tuple[Path, ...] | None
    """Calibration files; None if not configured, which is refused for cars that move."""
    task: TaskConfig
    tracker: TrackerConfig
    safety: SafetyParams
    text: str
    """Content of the file, for recordings."""
    uncalibrated_ranges: bool = False
    """True if ranges without calibration in the files may be used as received."""
    alone: int | None = None
    """Node of the only car that is driven, if its own computer decides for it alone."""
    marks: Path | None = None
    """File with the replay protection state of signed messages; None keeps no state."""

    @property
    def keys(self) -> list[bytes | None]:
        """Keys of all links and cars."""
        return [link.key for link in self.links] + [car.key for car in self.cars]

    @property
    def n_slots(self) -> int:
        """Number of moving nodes."""
        return int((~self.constellation.is_static).sum())

    def slot_of(self, car: CarConfig) -> int:
        """Return the slot of a car."""
        return self.constellation.index_of[car.node]
