"""What a message is found to be, and what is believed of the ways it may take."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from typing import TypeAlias

NS = 1_000_000_000
"""[1/s] Nanoseconds in a second."""

Mark: TypeAlias = tuple[int, int]
"""Boot, and the highest sequence number that was accepted of it."""


class Verdict(Enum):
    """What a message is."""

    FRESH = "fresh"
    LATE = "late"
    """Out of order, and new."""
    REBOOT = "reboot"
    """The first of a new start of its device, whose counters began again."""
    UNNUMBERED = "unnumbered"
    """Its format has no numbers."""
    DUPLICATE = "duplicate"
    """Accepted before, or too old to know."""
    STALE = "stale"
    """New, and of a start that is over: the clock it was stamped by is gone."""
    TWIN = "twin"
    """Two devices say they are this node."""
    REPLAY = "replay"
    """Recorded and sent again, or not to be told from that."""

    @property
    def accepted(self) -> bool:
        """Whether its readings are to be used."""
        return self in _ACCEPTED


_ACCEPTED = frozenset({Verdict.FRESH, Verdict.LATE, Verdict.REBOOT, Verdict.UNNUMBERED})


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentityParams:
    """Of `Identities`."""

    stragglers: int = 3
    """[-] So many new messages of the old start may follow the first of the next one, over a
    slower way; they are stale. More are a second device."""
    straggle: float = 0.2
    """[s] And for so long."""
    restarts: int = 8
    """[-] More restarts within `restart` are devices that take turns, or one that is broken."""
    restart: float = 10.0
    """[s]"""
    changes: int = 3
    """[-] Without boots: as many changes of link, each within `change`, are two devices."""
    change: float = 1.0
    """[s] A device that is plugged into another port is silent for longer."""
    refused: int = 8
    """[-] Without boots: so many refused numbers in a row, rising, are a device that began
    again, once nothing was accepted for `quiet`."""
    quiet: float = 2.0
    """[s]"""
    again: float = 10.0
    """[s] The same notice about the same node is not given again within this."""

    def __post_init__(self) -> None:
        for each in fields(self):
            if not getattr(self, each.name) > 0:
                raise ValueError(f"{each.name}: a number above 0 expected")
