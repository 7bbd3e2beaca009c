"""What swarm.toml says, checked."""

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
    """A stream that measures."""

    name: str
    port: PortSpec
    format: str
    """One of `hardware_bridge.decoders.DECODERS`."""
    node: int | None = None
    """Who speaks, where the format does not say."""
    ids: Mapping[str, int] = field(default_factory=dict)
    """Device id, as `Source.device` has it, to node."""
    key: bytes | None = None
    """Of the MAC, 16 bytes; None takes messages without one."""
    scanner: ScannerMount | None = None
    """Where it is on its car, if the stream is a scanner's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CarConfig:
    """A car that can be driven."""

    node: int
    """The node it carries."""
    port: PortSpec
    driver: str
    """One of `hardware_bridge.drivers.DRIVERS`."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """The driver's own."""
    key: bytes | None = None
    """As for links."""
    watchdog: float | None = None
    """[s] After which it stops by itself when it hears nothing, as `relpos doctor --watchdog`
    measures it; None where it was not measured, which is refused for cars that move."""
    cells: int = 0
    """In a row in its battery, for its voltage to be looked at; 0 where it is not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskConfig:
    """What is asked of the cars."""

    name: str = "hold"
    """One of `relpos_env.tasks.TASKS`."""
    room: tuple[float, float] = (6.0, 6.0)
    """[m] Width and depth of the floor that the task may use, round where the group starts."""
    command: Literal["plan", "link"] = "plan"
    """Where the velocity comes from that cars are asked for: the plan alone, or the messages of
    an operator on a link, who sees the room."""
    proximity: int = 0
    """Beams of the distance sensors round each car, for policies that see them; 0 for none."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """The task's own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerConfig:
    """How the group is tracked."""

    source: Literal["measurements", "positions"] = "measurements"
    """Whether our tracker makes positions of measurements, or they come ready from another."""
    filter: str = DEFAULT_FILTER
    """One of `tracking.filters.FILTERS`."""
    delay: float = 0.1
    """[s] Measurements wait so long for later ones that were taken before them."""
    accuracy: float | None = None
    """[m] Expected error up to which a pair is ok, 0.01 to 10; left out, 0.3 with a car and 0.5
    without."""
    positions: ReadyParams = ReadyParams()
    """What is believed of ready positions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SwarmConfig:
    """A group of real nodes and cars."""

    name: str
    constellation: Constellation
    """Moving nodes first: each is a slot of the environment, car or not."""
    links: tuple[LinkConfig, ...]
    cars: tuple[CarConfig, ...]
    """In the order of their nodes."""
    calibration: tuple[Path, ...] | None
    """Files; None if nothing was said of it, which is refused for cars that move."""
    task: TaskConfig
    tracker: TrackerConfig
    safety: SafetyParams
    text: str
    """The file itself, for recordings."""
    uncalibrated_ranges: bool = False
    """Whether ranges are good as they come, where the files hold nothing about them."""
    marks: Path | None = None
    """Keeps which signed messages are old, where any are signed; None keeps nothing."""

    @property
    def keys(self) -> list[bytes | None]:
        """Of all links and cars."""
        return [link.key for link in self.links] + [car.key for car in self.cars]

    @property
    def n_slots(self) -> int:
        """Moving nodes."""
        return int((~self.constellation.is_static).sum())

    def slot_of(self, car: CarConfig) -> int:
        """Slot of a car."""
        return self.constellation.index_of[car.node]
