"""Clock skew: the rate of another node's clock relative to the own one, per ordered pair.

A crystal is off by up to 20 ppm, which single-sided ranging turns into metres: the error is
c / 2 times the reply time times the skew. Two sources measure the skew: the carrier offset of
every message, quick and coarse (0.1 ppm), and the stamps, by the interval between two messages of
one sender in its own clock and in the receiver's. A radial speed v looks like a skew of v / c
and belongs in it. One scalar Kalman filter fuses both.
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
    """Model of the clocks."""

    max_skew: float = 60e-6
    """[1] Largest skew of two crystals of 20 ppm, with a margin."""
    carrier_std: float = 0.15e-6
    """[1] Noise of a carrier-offset reading."""
    stamp_std: float = 0.2e-9
    """[s] Noise of a receive stamp."""
    wander: float = 4e-16
    """[1/s] Spectral density of the skew: 20 ppb in 1 s, from oscillators and accelerations."""
    jump: float = 2.0
    """[m] Largest change of a range between two messages, reflections included; stamps that
    differ by more do not belong together."""
    max_interval: float = 4.0
    """[s] Longest interval between messages that measures the skew."""
    patience: int = 3
    """[-] Number of consecutive misfits after which the estimate is wrong."""


@dataclass(slots=True)
class SkewEstimate:
    """Relative rate of the receiver's clock to the sender's, minus 1."""

    time: int
    """Time of the last update, receiver's ticks without wraps."""
    mean: float = 0.0
    """Estimated skew [1]."""
    var: float = FIRST_VAR
    misfits: int = 0

    def carrier(self, p: ExchangeNumbers, now: int, offset: float) -> None:
        """Update by the carrier offset of a message received now [1]."""
        self._predict(p, now)
        self.mean, self.var = take_carrier(p, self.mean, self.var, offset)

    def interval(self, p: ExchangeNumbers, now: int, received: int, sent: int) -> tuple[int, float]:
        """Update by the stamps of two messages; return whether they fit, and their skew."""
        self._predict(p, now)
        fit, skew, self.mean, self.var, self.misfits = take_interval(
            p, self.mean, self.var, self.misfits, received, sent
        )
        return fit, skew

    def _predict(self, p: ExchangeNumbers, now: int) -> None:
        self.var = predict_skew(p, self.var, now - self.time)
        self.time = now
