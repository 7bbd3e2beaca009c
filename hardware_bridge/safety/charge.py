"""What a supervisor is responsible for, and the rhythm it keeps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from hardware_bridge.config.swarm import CarConfig
from hardware_bridge.identity import Mark
from hardware_bridge.safety.params import SafetyParams

TICK_NS = 10_000_000
"""[ns] From tick to tick."""
REPORT_EVERY = 5
"""[ticks]"""
ROOM = 1 << 20
"""[bytes] Of the buffers between the deciding process and the supervisor."""


@dataclass(frozen=True, slots=True)
class Charge:
    """What a supervisor is started with."""

    params: SafetyParams
    n_cars: int
    cars: tuple[tuple[int, CarConfig], ...]
    """Slot and configuration; none in a dry run."""
    boot: int = 0
    """Of this start, for what is signed; higher than that of any start before."""
    dry: tuple[int, ...] = ()
    """Slots of cars in a dry run: no port is opened, and the gate tells what it would allow."""
    marks: Mapping[str, Mapping[int, Mark]] = field(default_factory=dict)
    """Newest signed messages of starts before, by car: nothing as old is believed."""
