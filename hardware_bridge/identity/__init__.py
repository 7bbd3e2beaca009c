"""Who is speaking: each message taken once, restarts seen, two devices with one id told apart."""

from hardware_bridge.identity.identities import Identities
from hardware_bridge.identity.verdict import IdentityParams, Mark, Verdict

__all__ = ["Identities", "IdentityParams", "Mark", "Verdict"]
