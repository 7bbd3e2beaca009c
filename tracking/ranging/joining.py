"""Transmissions of a node that is not a member yet: at once, then with random backoff."""

from __future__ import annotations

from tracking.ranging.dice import Dice

MAX_DOUBLINGS = 5


class Joining:
    """Attempts of one node to join a round."""

    def __init__(self, dice: Dice) -> None:
        self._dice = dice
        self._attempts = self._pause = 0
        self._tried: int | None = None

    @property
    def in_vain(self) -> bool:
        """True if more than one attempt has failed."""
        return self._attempts > 1

    def succeeded(self) -> None:
        """Reset the backoff: the node is a member."""
        self._attempts = self._pause = 0

    def begin(self) -> None:
        """Start again."""
        self.succeeded()
        self._tried = None

    def may_transmit(self, round: int) -> bool:
        """Return whether to transmit in the gap that begins: once a round, after the backoff."""
        if round == self._tried:
            return False
        if self._pause > 0:
            self._pause -= 1
            return False
        self._attempts = min(self._attempts + 1, MAX_DOUBLINGS)
        self._pause = self._dice.bits(self._attempts)
        self._tried = round
        return True
