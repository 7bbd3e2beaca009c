"""Classes of messages, and parameters of links and devices."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from typing import TypeAlias

NS = 1_000_000_000
"""[1/s] Nanoseconds in a second."""

Mark: TypeAlias = tuple[int, int]
"""Boot, and its highest accepted sequence number."""


class Verdict(Enum):
    """Class of a message."""

    FRESH = "fresh"
    LATE = "late"
    """New, but out of order."""
    REBOOT = "reboot"
    """First message after a restart of its device, whose counters restarted, too."""
    UNNUMBERED = "unnumbered"
    """The format has no numbers."""
    DUPLICATE = "duplicate"
    """Accepted already, or too old to decide."""
    STALE = "stale"
    """New, but of a previous boot: the clock of its stamp no longer exists."""
    DUPLICATE_ID = "duplicate_id"
    """Two devices use the id of this node."""
    REPLAY = "replay"
    """Recorded and sent again, or indistinguishable from a replay."""

    @property
    def accepted(self) -> bool:
        """True if the readings are to be used."""
        return self in _ACCEPTED


_ACCEPTED = frozenset({Verdict.FRESH, Verdict.LATE, Verdict.REBOOT, Verdict.UNNUMBERED})


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentityParams:
    """Parameters of `Identities`."""

    stragglers: int = 3
    """[-] Largest number of new messages of the old boot after the first of the next one, over a
    slower path; they are stale. More of them are a second device."""
    straggle: float = 0.2
    """[s] Longest time after a restart in which such messages may arrive."""
    restarts: int = 8
    """[-] More restarts within `restart` are alternating devices or a broken one."""
    restart: float = 10.0
    """[s] Interval in which restarts are counted."""
    changes: int = 3
    """[-] Without boots: this number of link changes, each within `change`, is two devices."""
    change: float = 1.0
    """[s] Longest time between such changes; moving a device to another port takes longer."""
    refused: int = 8
    """[-] Without boots: this number of rising refused numbers in a row is a restart, once nothing
    was accepted for `quiet`."""
    quiet: float = 2.0
    """[s] Shortest time without accepted messages before such a restart."""
    again: float = 10.0
    """[s] Shortest interval between equal notices about a node."""

    def __post_init__(self) -> None:
        for each in fields(self):
            if not getattr(self, each.name) > 0:
                raise ValueError(f"{each.name}: a number above 0 expected")
