"""Fault plan of a run: probabilities of frame faults and a script of events, from a TOML file.

[frames]
loss = 0.02
corruption = 0.001

[[faults]]
t = 12.0
kind = "unplug"
target = "nodes.1"
seconds = 2.0
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hardware_bridge.emulator.faults import FaultParams
from hardware_bridge.errors import BridgeError
from tracking.params.tables import TableReader, Where

NODES, CARS, LINKS = "nodes", "cars", "links"
FAULT_KINDS: Mapping[str, tuple[str, ...]] = {
    "unplug": (NODES, CARS, LINKS),
    "reboot": (NODES, CARS),
    "clock-step": (NODES,),
    "stuck-sensor": (NODES,),
    "silence": (NODES, CARS),
    "duplicate-id": (NODES,),
}
"""Kinds of faults and the groups of targets that they apply to."""
REBOOT = 1.0
"""[s] Default silence of a device that starts."""
_TARGET = re.compile(r"(nodes|cars)\.([0-9]{1,9})|links\.([A-Za-z0-9_-]{1,64})")


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A single fault of the script."""

    t: float
    """[s] Time since the start of the world."""
    kind: str
    """``unplug``: the port is gone, and comes back with the same name. ``reboot``: silence, then
    the next boot number and a clock from 0; a car discards its command. ``clock-step``: the node's
    clock jumps. ``stuck-sensor``: the IMU repeats its last sample. ``silence``: the device works
    but sends nothing. ``duplicate-id``: a second device sends with the same id on the same line."""
    target: str
    """Target: ``nodes.1``, ``cars.1`` or a port, ``links.n1`` or ``links.operator``."""
    seconds: float = REBOOT
    """[s] Duration; for ``clock-step`` the size of the jump, which may be negative."""

    def __post_init__(self) -> None:
        if self.kind not in FAULT_KINDS:
            raise BridgeError(f"kind: expected one of {', '.join(FAULT_KINDS)}, got {self.kind!r}")
        if not _TARGET.fullmatch(self.target):
            raise BridgeError(
                f"target: expected nodes.ID, cars.ID or links.NAME, got {self.target!r}"
            )
        if self.group not in FAULT_KINDS[self.kind]:
            groups = " or ".join(FAULT_KINDS[self.kind])
            raise BridgeError(f"target: {self.kind} is for {groups}, got {self.target!r}")
        if not 0.0 <= self.t <= 1e6:
            raise BridgeError(f"t: expected 0 to 1e6 s, got {self.t!r}")
        least = -1e6 if self.kind == "clock-step" else 0.0
        if not least <= self.seconds <= 1e6:
            raise BridgeError(f"seconds: expected {least:g} to 1e6, got {self.seconds!r}")

    @property
    def group(self) -> str:
        """The group of the target: ``nodes``, ``cars`` or ``links``."""
        return self.target.split(".", 1)[0]

    @property
    def name(self) -> str:
        """The target without its group."""
        return self.target.split(".", 1)[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultPlan:
    """All faults of a run; by default there are none."""

    frames: FaultParams = field(default_factory=FaultParams)
    """Frame faults of the lines of the nodes."""
    faults: tuple[Fault, ...] = ()

    def check(self, targets: Collection[str]) -> None:
        """Refuse faults of unknown targets.

        Raises:
            BridgeError: A target is unknown; the first one and the known ones are named.
        """
        for k, fault in enumerate(self.faults):
            if fault.target not in targets:
                raise BridgeError(
                    f"faults[{k}].target: expected one of {', '.join(targets)}, "
                    f"got {fault.target!r}"
                )


def read_faults(path: Path) -> FaultPlan:
    """Read a fault plan.

    Raises:
        BridgeError: No such file, invalid TOML, or an unknown, missing or invalid key; file and key
            are named.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise BridgeError(f"{path}: expected a TOML file ({error})") from error
    return parse_faults(table, path.name)


def parse_faults(table: Mapping[str, Any], file: str = "faults") -> FaultPlan:
    """Return the fault plan of a parsed file.

    Args:
        table: Contents of the file.
        file: Name of the file, for messages.

    Raises:
        BridgeError: As `read_faults`.
    """
    return TableReader().read(FaultPlan, table, Where(file, raises=BridgeError))
