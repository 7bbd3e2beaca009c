"""How fast another node's clock runs relative to one's own: the clock skew, per ordered pair.

A crystal is off by up to 20 ppm, which single-sided ranging turns into metres: the error is
c / 2 times the reply time times the skew. Two sources tell it: the carrier offset that the
radio reads from every message, quick and coarse (0.1 ppm), and the stamps themselves, since
two messages of one sender are so far apart in its own clock and so far in the receiver's. A
radial speed v looks like a skew of v / c and belongs in it. One scalar Kalman filter takes both.
"""

from __future__ import annotations

from dataclasses import dataclass

from tracking.ranging.compiled.exchange import (
    FIRST_VAR,
    ExchangeNumbers,
    predict_skew,
    take_carrier,
    take_interval,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockParams:
    """What a node believes of clocks."""

    max_skew: float = 60e-6
    """[1] Two crystals of 20 ppm and some; more is no clock of ours."""
    carrier_std: float = 0.15e-6
    """[1] Noise of a carrier-offset reading."""
    stamp_std: float = 0.2e-9
    """[s] Noise of a receive stamp."""
    wander: float = 4e-16
    """[1/s] Spectral density of the skew: 20 ppb in a second, oscillators and accelerations."""
    jump: float = 2.0
    """[m] More than a range can change between two messages, reflections included; stamps that
    differ by more do not belong together."""
    max_interval: float = 4.0
    """[s] Messages farther apart say nothing about each other's clocks."""
    patience: int = 3
    """[-] After so many misfits in a row it is the estimate that is wrong."""


@dataclass(slots=True)
class SkewEstimate:
    """How much faster the receiver's clock runs than the sender's."""

    time: int
    """Of the last update, receiver's ticks without wraps."""
    mean: float = 0.0
    """[1]"""
    var: float = FIRST_VAR
    misfits: int = 0

    def carrier(self, p: ExchangeNumbers, now: int, offset: float) -> None:
        """Take the carrier offset of a message received now [1]."""
        self._predict(p, now)
        self.mean, self.var = take_carrier(p, self.mean, self.var, offset)

    def interval(self, p: ExchangeNumbers, now: int, received: int, sent: int) -> tuple[int, float]:
        """Take the stamps of two messages; whether they fit, and the skew that they tell."""
        self._predict(p, now)
        fit, skew, self.mean, self.var, self.misfits = take_interval(
            p, self.mean, self.var, self.misfits, received, sent
        )
        return fit, skew

    def _predict(self, p: ExchangeNumbers, now: int) -> None:
        self.var = predict_skew(p, self.var, now - self.time)
        self.time = now
