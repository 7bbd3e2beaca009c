"""Identity checks for formats without boot numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

from hardware_bridge.identity.boots import OF_PLACE, two_devices
from hardware_bridge.identity.verdict import NS, IdentityParams, Verdict
from hardware_bridge.identity.window import MODULUS, SequenceWindow

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")

MOST_DEVICES = 16
"""[-] Number of names and links that are remembered of one node."""


@dataclass(slots=True)
class _LastMessage:
    """Last link of a device that names itself."""

    link: str
    t_ns: int
    changes: int = 0


@dataclass(slots=True)
class _Numbers:
    """Sequence numbers of one stream."""

    window: SequenceWindow
    accepted_ns: int
    refused: int = 0
    """Number of refused, rising numbers in a row."""
    last: int = 0
    """Last refused number."""


class Unbooted:
    """Checks of the messages of one node that carry no boot number.

    A device that names itself sends on one link; unnamed messages are assigned by the configuration
    of their port, and a node may have several such ports. Two devices on one link cannot be
    distinguished here.
    """

    duplicate_reason: str = ""
    """Reason why the last message was classified as DUPLICATE_ID."""

    def __init__(self, params: IdentityParams) -> None:
        self._params = params
        self._last_messages: dict[str, _LastMessage] = {}
        self._numbers: dict[tuple[str | None, str], _Numbers] = {}

    def check(self, link: str, device: str | None, sequence: int | None, t_ns: int) -> Verdict:
        """Classify a message and store its number."""
        if device is not None and self._is_elsewhere(link, device, t_ns):
            return Verdict.DUPLICATE_ID
        if sequence is None:
            return Verdict.UNNUMBERED
        numbers = self._numbers.get((device, link))
        if numbers is None:
            _make_room(self._numbers)
            window = SequenceWindow(sequence, endless=True)
            self._numbers[device, link] = _Numbers(window, t_ns)
            return Verdict.FRESH
        verdict = OF_PLACE[numbers.window.place(sequence)]
        if not verdict.accepted:
            if not self._began_anew(numbers, sequence, t_ns):
                return verdict
            numbers.window = SequenceWindow(sequence, endless=True)
            verdict = Verdict.REBOOT
        numbers.window.take(sequence)
        numbers.accepted_ns, numbers.refused = t_ns, 0
        return verdict

    def _is_elsewhere(self, link: str, device: str, t_ns: int) -> bool:
        """Return whether a device alternates between this link and another."""
        last = self._last_messages.get(device)
        if last is None:
            _make_room(self._last_messages)
            self._last_messages[device] = _LastMessage(link, t_ns)
            return False
        if link != last.link:
            soon = t_ns - last.t_ns < self._params.change * NS
            last.changes = last.changes + 1 if soon else 0
            if last.changes >= self._params.changes:
                self.duplicate_reason = two_devices(last.link, link)
                return True
            last.link = link
        elif t_ns - last.t_ns >= self._params.change * NS:
            last.changes = 0
        last.t_ns = t_ns
        return False

    def _began_anew(self, numbers: _Numbers, sequence: int, t_ns: int) -> bool:
        """Return whether a refused number belongs to a sequence that only a restart explains."""
        rising = 0 < (sequence - numbers.last) % MODULUS < self._params.refused
        numbers.refused = numbers.refused + 1 if rising else 1
        numbers.last = sequence
        quiet = t_ns - numbers.accepted_ns >= self._params.quiet * NS
        return quiet and numbers.refused >= self._params.refused


def _make_room(remembered: dict[_Key, _Value]) -> None:
    """Remove the oldest entry if there are too many."""
    if len(remembered) >= MOST_DEVICES:
        del remembered[next(iter(remembered))]
