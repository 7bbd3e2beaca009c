"""Starts of one node: the current boot, and messages of other boots."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from hardware_bridge.identity.verdict import NS, IdentityParams, Mark, Verdict
from hardware_bridge.identity.window import Place, SequenceWindow

MOST_BOOTS = 64
"""[-] Number of boots remembered of one node. A forgotten one would count as new."""

OF_PLACE = {
    Place.AHEAD: Verdict.FRESH,
    Place.NEW: Verdict.LATE,
    Place.SEEN: Verdict.DUPLICATE,
    Place.OLD: Verdict.DUPLICATE,
}


class RisingBoots:
    """Authenticated boot numbers, which rise: messages of a lower one are replays."""

    mark: Mark | None

    def __init__(self, mark: Mark | None = None) -> None:
        """Create a check.

        Args:
            mark: Last message accepted before a restart of the host; nothing up to it is accepted
                again.
        """
        self.mark = mark
        self._window = SequenceWindow(0 if mark is None else mark[1], endless=False, before=False)

    def check(self, boot: int | None, sequence: int | None) -> Verdict:
        """Classify a message and store its number; never DUPLICATE_ID."""
        if boot is None or sequence is None:
            return Verdict.REPLAY
        if self.mark is None or boot > self.mark[0]:
            verdict = Verdict.FRESH if self.mark is None else Verdict.REBOOT
            self._window = SequenceWindow(sequence, endless=False)
        elif boot < self.mark[0]:
            return Verdict.REPLAY
        else:
            place = self._window.place(sequence)
            if place is Place.OLD:
                return Verdict.REPLAY
            verdict = OF_PLACE[place]
            self._window.take(sequence)
        self.mark = boot, self._window.highest
        return verdict


@dataclass(slots=True)
class _Boot:
    """State of one boot of a device."""

    window: SequenceWindow | None
    link: str
    over_ns: int = 0
    """[ns] Time at which the next boot began."""
    stragglers: int = 0

    def place(self, sequence: int | None) -> Place:
        """Return the place of a message in the window and store its number."""
        if sequence is None or self.window is None:
            return Place.AHEAD
        place = self.window.place(sequence)
        self.window.take(sequence)
        return place


class ClaimedBoots:
    """Boot numbers without authentication: a new one is a restart if the old one is silent."""

    duplicate_reason: str = ""
    """Reason why the last message was classified as DUPLICATE_ID."""

    def __init__(self, params: IdentityParams) -> None:
        self._params = params
        self._boot: int | None = None
        self._boots: dict[int, _Boot] = {}
        """Current and previous boots, oldest first."""
        self._restarts: deque[int] = deque()

    def check(self, link: str, boot: int, sequence: int | None, t_ns: int) -> Verdict:
        """Classify a message and store its number."""
        if boot not in self._boots:
            return self._begin(link, boot, sequence, t_ns)
        state = self._boots[boot]
        if boot == self._boot:
            state.link = link
        place = state.place(sequence)
        if boot == self._boot:
            return Verdict.UNNUMBERED if sequence is None else OF_PLACE[place]
        if place in (Place.SEEN, Place.OLD):
            return Verdict.DUPLICATE
        if place is Place.AHEAD:
            state.stragglers += 1
            late = t_ns - state.over_ns > self._params.straggle * NS
            if late or state.stragglers > self._params.stragglers:
                self.duplicate_reason = self._where(link)
                return Verdict.DUPLICATE_ID
        return Verdict.STALE

    def _begin(self, link: str, boot: int, sequence: int | None, t_ns: int) -> Verdict:
        """Classify the first message of a boot."""
        first = self._boot is None
        if self._boot is not None:
            self._boots[self._boot].over_ns = t_ns
            self._restarts.append(t_ns)
            while self._restarts[0] < t_ns - self._params.restart * NS:
                self._restarts.popleft()
            if len(self._restarts) > self._params.restarts:
                self.duplicate_reason = (
                    f"started {len(self._restarts)} times within {self._params.restart:g} s, "
                    f"last on link {link}"
                )
                return Verdict.DUPLICATE_ID
        if len(self._boots) >= MOST_BOOTS:
            del self._boots[next(iter(self._boots))]
        window = None if sequence is None else SequenceWindow(sequence, endless=True)
        self._boot, self._boots[boot] = boot, _Boot(window, link)
        return Verdict.FRESH if first else Verdict.REBOOT

    def _where(self, link: str) -> str:
        """Return the notice about two devices, one of which sends on this link."""
        assert self._boot is not None
        return two_devices(self._boots[self._boot].link, link)


def two_devices(link: str, other: str) -> str:
    """Return a text with the links of the two devices."""
    if link == other:
        return f"is two devices, both on link {link}"
    return "is two devices, on links " + " and ".join(sorted((link, other)))
