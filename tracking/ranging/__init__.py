"""Ranging protocol without clock and radio; see `docs/reference/protocol.md`."""

from tracking.ranging.events import (
    DuplicateId,
    MembersChanged,
    Reception,
    Role,
    RoleChanged,
    Transmission,
)
from tracking.ranging.exchange import RangeEvent
from tracking.ranging.params import SessionParams
from tracking.ranging.session import Session

__all__ = [
    "DuplicateId",
    "MembersChanged",
    "RangeEvent",
    "Reception",
    "Role",
    "RoleChanged",
    "Session",
    "SessionParams",
    "Transmission",
]
