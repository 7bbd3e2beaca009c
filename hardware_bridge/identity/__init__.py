"""Identity of senders: duplicates, restarts and two devices with the same id."""

from hardware_bridge.identity.identities import Identities
from hardware_bridge.identity.verdict import IdentityParams, Mark, Verdict

__all__ = ["Identities", "IdentityParams", "Mark", "Verdict"]
