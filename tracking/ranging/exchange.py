"""Ranges from overheard stamps: any node that receives two others knows their distance.

For every ordered pair the last message that one node sent and the other received is stored
with both stamps. The node with the smaller ID asks, the one with the larger ID answers:

    asker       sends T_a ---------------------------- receives R_a        later: R_a is reported
    answerer    ------------- receives R_b --- sends T_b (reports R_b)

    time of flight = ((R_a - T_a) - (T_b - R_b) (1 + skew)) / 2

with the skew of `tracking.ranging.clocks`. The range is valid at the time T_a.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from tracking.ranging.clocks import ClockParams, SkewEstimate
from tracking.ranging.compiled.exchange import NO_INTERVAL, ExchangeNumbers, exchange_distance


@dataclass(frozen=True, slots=True, kw_only=True)
class ExchangeParams:
    """Requirements of stamps for a range."""

    clocks: ClockParams = field(default_factory=ClockParams)
    max_distance: float = 200.0
    """[m] Largest range of the radio; longer results are dropped."""
    max_reply: float = 4.0
    """[s] Longest time to an answer; longer than a round of 62 nodes."""
    max_error: float = 0.05
    """[m] Largest error by clock skew, one sigma, of a range without a fresh interval."""

    def numbers(self) -> ExchangeNumbers:
        """Return the numbers of the kernels."""
        c = self.clocks
        return ExchangeNumbers(
            c.max_skew, c.carrier_std * c.carrier_std, c.stamp_std, c.wander, c.jump,
            c.max_interval, c.patience, self.max_distance, self.max_reply, self.max_error,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Passage:
    """One message from a sender to a receiver; each end in its own clock, without wraps."""

    sent: int
    received: int
    local: int
    """Transmit time in the clock of the node that stores the passage."""


@dataclass(frozen=True, slots=True)
class RangeEvent:
    """Distance between two nodes, computed by one of them or by a third one."""

    i: int
    """Smaller ID."""
    j: int
    """Larger ID."""
    time: int
    """Time of validity, this node's clock, 40-bit stamp."""
    distance: float
    """Distance [m]."""
    rx_power: float
    """Received power of the answer at node i [dBm]."""
    fp_power: float
    """First-path power of the answer at node i [dBm]."""


class Exchanges:
    """Passages known to one node, and the ranges that follow from them.

    Property: noiseless stamps of clocks with any skew give the distance at the time of the
    range, within the resolution of the stamps.
    """

    def __init__(self, params: ExchangeParams) -> None:
        self._numbers = params.numbers()
        self._asked: dict[tuple[int, int], Passage] = {}
        self._answered: dict[tuple[int, int], Passage] = {}
        self._skew: dict[tuple[int, int], SkewEstimate] = {}

    def forget(self, node: int | None = None) -> None:
        """Drop a node, or all, after a jump of its clock or its departure."""
        for known in (self._asked, self._answered, self._skew):
            for pair in [p for p in known if node is None or node in p]:
                del known[pair]  # type: ignore[attr-defined]

    def carrier(self, asker: int, answerer: int, now: int, offset: float) -> None:
        """Process the carrier offset of a message: relative rate of the receiver's clock [1]."""
        if asker < answerer:
            skew = self._skew.setdefault((asker, answerer), SkewEstimate(now))
            skew.carrier(self._numbers, now, offset)

    def add(self, sender: int, receiver: int, passage: Passage) -> tuple[float, int] | None:
        """Process a passage; return distance [m] and time, own clock, of a completed exchange."""
        if sender < receiver:
            self._asked[sender, receiver] = passage
            return None
        pair = receiver, sender
        last, self._answered[pair] = self._answered.get(pair), passage
        skew = self._skew.setdefault(pair, SkewEstimate(passage.received))
        received, sent = (
            (passage.received - last.received, passage.sent - last.sent) if last else (0, 0)
        )
        fit, interval = skew.interval(self._numbers, passage.received, received, sent)
        question = self._asked.pop(pair, None)
        if question is None:
            return None
        round_trip, reply = passage.received - question.sent, passage.sent - question.received
        if last is None:
            fit = NO_INTERVAL
        distance = exchange_distance(
            self._numbers, round_trip, reply, fit, interval, skew.mean, skew.var
        )
        return (distance, question.local) if distance > 0.0 else None
