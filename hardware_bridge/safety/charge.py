"""Configuration of a supervisor and its periods."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from hardware_bridge.config.swarm import CarConfig
from hardware_bridge.identity import Mark
from hardware_bridge.safety.params import SafetyParams

TICK_NS = 10_000_000
"""[ns] Period of the ticks."""
REPORT_EVERY = 5
"""[ticks] Period of the reports."""
ROOM = 1 << 20
"""[bytes] Size of the buffers between the deciding process and the supervisor."""


@dataclass(frozen=True, slots=True)
class Charge:
    """Configuration that a supervisor is started with."""

    params: SafetyParams
    n_cars: int
    cars: tuple[tuple[int, CarConfig], ...]
    """Slot and configuration of each car; empty in a dry run."""
    boot: int = 0
    """Boot number of this start, for signatures; higher than that of any earlier start."""
    dry: tuple[int, ...] = ()
    """Slots of cars in a dry run: no port is opened, and the gate only reports its output."""
    marks: Mapping[str, Mapping[int, Mark]] = field(default_factory=dict)
    """Newest signed messages of earlier starts, by port name; messages up to these are refused."""
