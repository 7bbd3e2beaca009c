"""Identities of the nodes of a swarm, and acceptance of their messages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hardware_bridge.identity.boots import ClaimedBoots, RisingBoots
from hardware_bridge.identity.unbooted import Unbooted
from hardware_bridge.identity.verdict import NS, IdentityParams, Mark, Verdict
from hardware_bridge.identity.window import MODULUS
from hardware_bridge.readings import Source

MOST_NOTICES = 256
"""[-] Largest number of pending notices; further ones are dropped."""
MANY_OLD = 200
"""[-] Number of messages refused in a row that is reported to the operator."""


@dataclass(slots=True)
class _Node:
    """State of one node."""

    boots: ClaimedBoots
    unbooted: Unbooted
    quarantined: bool = False
    refused: int = 0
    """Number of messages refused in a row."""


class Identities:
    """Filter that accepts every message once, and from one device per node only.

    Invariants: a message (node, boot, sequence) of the last `boots.MOST_BOOTS` boots is accepted at
    most once; a new one of the current boot that is less than `window.WIDTH` numbers late is
    accepted; a restart is detected with its first message, and restarts alone cause a quarantine
    only if there are more than eight in ten seconds; two devices with one id that both keep sending
    are detected, and both refused until `release`. Authenticated: no message is ever accepted
    twice, for any repetition and order, and nothing is quarantined. Memory is bounded for any
    input.
    """

    notices: list[tuple[int, str]]
    """Time [ns] and text of notices to the operator; the reader clears the list."""

    def __init__(self, authenticated: bool = False, params: IdentityParams | None = None) -> None:
        """Create a filter without known nodes.

        Args:
            authenticated: True if every message has passed the check of its MAC, and boots rise.
                Messages without boot or number are then refused as replays: streams of other
                formats need an object of their own.
            params: Parameters of links and devices.
        """
        self._authenticated = authenticated
        self._params = IdentityParams() if params is None else params
        self._nodes: dict[int, _Node] = {}
        self._rising: dict[int, RisingBoots] = {}
        self._noticed: dict[tuple[int, str], int] = {}
        self.notices = []

    @property
    def quarantined(self) -> tuple[int, ...]:
        """Nodes that are refused until they are released."""
        return tuple(sorted(k for k, node in self._nodes.items() if node.quarantined))

    def check(self, link: str, source: Source, t_ns: int, node: int) -> Verdict:
        """Classify a message, once for all readings that it holds, and store its number.

        Args:
            link: Name of its link, `PortSpec.name`.
            source: Its source.
            t_ns: Arrival, by the host's monotonic clock [ns].
            node: Node id of `source.device`, one of the configuration.
        """
        if self._authenticated:
            return self._check_rising(link, source, t_ns, node)
        state = self._nodes.get(node)
        if state is None:
            boots, unbooted = ClaimedBoots(self._params), Unbooted(self._params)
            state = self._nodes[node] = _Node(boots, unbooted)
        if state.quarantined:
            return Verdict.DUPLICATE_ID
        judge: ClaimedBoots | Unbooted
        if source.boot is None:
            judge = state.unbooted
            verdict = judge.check(link, source.device, source.sequence, t_ns)
        else:
            judge = state.boots
            verdict = judge.check(link, source.boot, source.sequence, t_ns)
        state.refused = 0 if verdict.accepted else state.refused + 1
        if verdict is Verdict.DUPLICATE_ID:
            state.quarantined = True
            text = f"{judge.duplicate_reason}: refused until it is released"
            self._note(t_ns, node, "duplicate_id", text)
        elif verdict is Verdict.REBOOT:
            self._note(t_ns, node, "reboot", f"started again, on link {link}")
        elif state.refused == MANY_OLD:
            text = f"sends only old messages, on link {link}: refused until this is started again"
            self._note(t_ns, node, "old", text)
        return verdict

    def release(self, node: int, t_ns: int) -> None:
        """Accept a node again and discard its state; no effect if authenticated."""
        if self._nodes.pop(node, None) is not None:
            self._noticed = {key: t for key, t in self._noticed.items() if key[0] != node}
            self._note(t_ns, node, "release", "is released")

    def high_water(self, ahead: int = 0) -> dict[int, Mark]:
        """Return the marks to keep across a restart of the host, by node; authenticated only.

        Args:
            ahead: Number of further messages of each node that count as received. Marks saved every
                minute, with more messages ahead than arrive in a minute, leave no gap for a replay
                after a crash; a node whose boot continues is then refused up to its mark.
        """
        marks = {node: boots.mark for node, boots in self._rising.items()}
        return {k: (m[0], min(m[1] + ahead, MODULUS - 1)) for k, m in marks.items() if m}

    def restore(self, marks: Mapping[int, Mark]) -> None:
        """Refuse everything up to these marks of `high_water`; lower ones have no effect."""
        for node, mark in marks.items():
            known = self._rising.get(node)
            if known is None or known.mark is None or known.mark < mark:
                self._rising[node] = RisingBoots(mark)

    def _check_rising(self, link: str, source: Source, t_ns: int, node: int) -> Verdict:
        if node not in self._rising:
            self._rising[node] = RisingBoots()
        verdict = self._rising[node].check(source.boot, source.sequence)
        if verdict is Verdict.REBOOT:
            self._note(t_ns, node, "reboot", f"started again, on link {link}")
        elif verdict is Verdict.REPLAY:
            self._note(
                t_ns,
                node,
                "replay",
                f"is sent old messages on link {link}: recorded ones, or a second device with its "
                "key; refused",
            )
        return verdict

    def _note(self, t_ns: int, node: int, kind: str, text: str) -> None:
        """Add a notice to the operator, with a minimum interval for each kind."""
        before = self._noticed.get((node, kind))
        if before is not None and t_ns - before < self._params.again * NS:
            return
        self._noticed[node, kind] = t_ns
        if len(self.notices) < MOST_NOTICES:
            self.notices.append((t_ns, f"node {node} {text}"))
