"""What goes into a session and what comes out of it, apart from bytes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from tracking.ranging.exchange import RangeEvent


class Role(Enum):
    """What a node does in the round."""

    LISTENING = "listening"
    """Just switched on, or reset: hears before it speaks."""
    INITIATOR = "initiator"
    """Starts every round."""
    RESPONDER = "responder"
    """Follows the rounds of a smaller ID."""
    MUTED = "muted"
    """Heard another node with its own ID and keeps silent for a while."""


@dataclass(frozen=True, slots=True)
class Reception:
    """What the radio tells of a frame that came in."""

    stamp: int
    """When its stamp moment arrived, 40 bits."""
    rx_power: float
    """[dBm]"""
    fp_power: float
    """First path [dBm]."""
    carrier: float | None = None
    """How much faster this node's clock runs than the sender's, by the carrier [1]."""


@dataclass(frozen=True, slots=True)
class Transmission:
    """A frame to be sent."""

    data: bytes
    at: int
    """When its stamp moment is to leave: 40 bits, a multiple of 512."""


@dataclass(frozen=True, slots=True)
class RoleChanged:
    """The node does something else from now on."""

    role: Role
    root: int
    """The initiator that it follows, its own ID if that is itself."""


@dataclass(frozen=True, slots=True)
class MembersChanged:
    """The group that ranges in each round is another one."""

    members: tuple[int, ...]
    before: tuple[int, ...]

    @property
    def joined(self) -> tuple[int, ...]:
        """Members that were none before."""
        return tuple(k for k in self.members if k not in self.before)

    @property
    def left(self) -> tuple[int, ...]:
        """Members that are none any more."""
        return tuple(k for k in self.before if k not in self.members)


@dataclass(frozen=True, slots=True)
class DuplicateId:
    """Another node uses this node's ID."""

    id: int
    boot: int
    """Its boot number."""


Event = RangeEvent | RoleChanged | MembersChanged | DuplicateId
Output = Transmission | Event
