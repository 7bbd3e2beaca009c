"""When a node that is no member yet speaks: at once, and if in vain after drawn pauses."""

from __future__ import annotations

from tracking.ranging.dice import Dice

MAX_DOUBLINGS = 5


class Joining:
    """The attempts of one node to be taken into a round."""

    def __init__(self, dice: Dice) -> None:
        self._dice = dice
        self._attempts = self._pause = 0
        self._tried: int | None = None

    @property
    def in_vain(self) -> bool:
        """Whether more than one attempt has failed."""
        return self._attempts > 1

    def succeeded(self) -> None:
        """The node is a member: the next time begins at once again."""
        self._attempts = self._pause = 0

    def begin(self) -> None:
        """The node begins again."""
        self.succeeded()
        self._tried = None

    def speaks(self, round: int) -> bool:
        """Whether to speak in the gap that begins now: once a round, after drawn gaps."""
        if round == self._tried:
            return False
        if self._pause > 0:
            self._pause -= 1
            return False
        self._attempts = min(self._attempts + 1, MAX_DOUBLINGS)
        self._pause = self._dice.bits(self._attempts)
        self._tried = round
        return True
