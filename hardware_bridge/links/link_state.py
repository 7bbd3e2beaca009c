"""One port over time: open, lost, tried again ever less often."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.links.stream import Port

SOONEST = 100_000_000
"""[ns] From a loss to the first attempt to open the port again; doubles from attempt to attempt."""
LATEST = 2_000_000_000
"""[ns] Between two attempts. A port that was open for so long starts from `SOONEST` again."""

ASK_AGAIN = 1_000_000_000
"""[ns] Of silence, after which a device that measures only when it is asked is asked again: it was
still starting, or has lost its power alone."""


@dataclass(frozen=True, slots=True)
class LinkNotice:
    """A link came up or went down."""

    link: str
    t_ns: int
    """When it was noticed, by the host's monotonic clock [ns]."""
    up: bool
    reason: str = ""
    """Why it is down."""


@dataclass(slots=True)
class LinkState:
    """A port and what became of it."""

    spec: PortSpec
    since_ns: int
    """When it came up or went down [ns]."""
    port: Port | None = None
    """None while it is down."""
    fd: int = -1
    reason: str = "not opened yet"
    """Why it is down; empty while it is up."""
    delay_ns: int = SOONEST
    """To the next attempt."""
    retry_ns: int | None = None
    """When to open it; None while it is open or being opened."""
    waits_to_write: bool = False
    """Part of a message is left, for which there was no room."""
    asked_ns: int = 0
    """When its request was sent last, or bytes came last [ns]."""

    def back_off(self, now: int) -> None:
        """Set when to try again, and wait twice as long the next time."""
        self.retry_ns = now + self.delay_ns
        self.delay_ns = min(2 * self.delay_ns, LATEST)

    def forgive(self, now: int) -> None:
        """A port that was open long enough is tried soon again; a loose contact is not."""
        if now - self.since_ns >= LATEST:
            self.delay_ns = SOONEST


def check_distinct(specs: Sequence[PortSpec]) -> None:
    """Each port has a name and a device of its own.

    Raises:
        BridgeError: Two have the same.
    """
    seen: dict[str, str] = {}
    names: set[str] = set()
    for spec in specs:
        if spec.name in names:
            raise BridgeError(f"{spec.name}: there are two ports of this name")
        names.add(spec.name)
        is_path = not spec.port.startswith(("tcp:", "serial:"))
        device = os.path.realpath(spec.port.removeprefix("file:")) if is_path else spec.port
        if device in seen:
            raise BridgeError(
                f"{spec.name}: {spec.port} is the port of {seen[device]} too; give each its own"
            )
        seen[device] = spec.name
