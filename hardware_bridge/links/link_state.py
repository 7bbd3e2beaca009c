"""State of one port: open, or lost and retried with exponential backoff."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.links.stream import Port

SOONEST = 100_000_000
"""[ns] Delay from a loss to the first attempt to open the port; doubles with every attempt."""
LATEST = 2_000_000_000
"""[ns] Longest delay between attempts. Ports that were open for this time restart at `SOONEST`."""

ASK_AGAIN = 1_000_000_000
"""[ns] Silence after which a device that measures on request is requested again: it was still
starting, or lost only its power."""


@dataclass(frozen=True, slots=True)
class LinkNotice:
    """Notice of a link that came up or went down."""

    link: str
    t_ns: int
    """Time of detection, by the host's monotonic clock [ns]."""
    up: bool
    reason: str = ""
    """Reason for being down."""


@dataclass(slots=True)
class LinkState:
    """A port and its state."""

    spec: PortSpec
    since_ns: int
    """Time at which it came up or went down [ns]."""
    port: Port | None = None
    """None while it is down."""
    fd: int = -1
    reason: str = "not opened yet"
    """Reason for being down; empty while it is up."""
    delay_ns: int = SOONEST
    """Delay of the next attempt."""
    retry_ns: int | None = None
    """Time to open it; None while it is open or being opened."""
    waits_to_write: bool = False
    """True if a message was sent in part, since the buffer was full."""
    asked_ns: int = 0
    """Time of the last request, or of the last received bytes [ns]."""

    def back_off(self, now: int) -> None:
        """Schedule the next attempt, and double the delay."""
        self.retry_ns = now + self.delay_ns
        self.delay_ns = min(2 * self.delay_ns, LATEST)

    def forgive(self, now: int) -> None:
        """Reset the delay if the port was open for long enough, unlike one with a loose contact."""
        if now - self.since_ns >= LATEST:
            self.delay_ns = SOONEST


def check_distinct(specs: Sequence[PortSpec]) -> None:
    """Check that all ports have distinct names and devices.

    Raises:
        BridgeError: Two ports share a name or device.
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
