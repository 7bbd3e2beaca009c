"""Inputs and outputs of a session, except bytes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from tracking.ranging.exchange import RangeEvent
from tracking.ranging.frames.motion import Motion


class Role(Enum):
    """Role of a node in the round."""

    LISTENING = "listening"
    """Switched on or reset: listens before it transmits."""
    INITIATOR = "initiator"
    """Starts every round."""
    RESPONDER = "responder"
    """Follows the rounds of a smaller ID."""
    MUTED = "muted"
    """Received another node with its own ID; silent for a while."""


@dataclass(frozen=True, slots=True)
class Reception:
    """Radio data of a received frame."""

    stamp: int
    """Arrival of its stamp moment, 40 bits."""
    rx_power: float
    """Received power [dBm]."""
    fp_power: float
    """First-path power [dBm]."""
    carrier: float | None = None
    """Relative rate of this node's clock to the sender's, minus 1, by the carrier [1]."""


@dataclass(frozen=True, slots=True)
class Transmission:
    """A frame to be sent."""

    data: bytes
    at: int
    """Transmit time of its stamp moment: 40 bits, a multiple of 512."""


@dataclass(frozen=True, slots=True)
class RoleChanged:
    """Change of the node's role or initiator."""

    role: Role
    root: int
    """Initiator that the node follows; its own ID if it is the initiator."""


@dataclass(frozen=True, slots=True)
class MembersChanged:
    """Change of the group that ranges in each round."""

    members: tuple[int, ...]
    before: tuple[int, ...]

    @property
    def joined(self) -> tuple[int, ...]:
        """New members."""
        return tuple(k for k in self.members if k not in self.before)

    @property
    def left(self) -> tuple[int, ...]:
        """Former members."""
        return tuple(k for k in self.before if k not in self.members)


@dataclass(frozen=True, slots=True)
class DuplicateId:
    """Another node uses this node's ID."""

    id: int
    boot: int
    """Boot number of the other node."""


@dataclass(frozen=True, slots=True)
class MotionEvent:
    """Preintegrated motion of another node, see `tracking.ranging.frames.motion`."""

    id: int
    """Node that moved."""
    boot: int
    """Boot number of the node: sums of different boots do not belong together."""
    time: int
    """Time of the sums, this node's clock, 40-bit stamp."""
    motion: Motion


Event = RangeEvent | MotionEvent | RoleChanged | MembersChanged | DuplicateId
Output = Transmission | Event
