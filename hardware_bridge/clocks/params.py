"""Parameters of the clocks of devices and the delays of links."""

from __future__ import annotations

from dataclasses import dataclass, fields

NS = 1_000_000_000
"""[1/s] Nanoseconds in a second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockParams:
    """Parameters of `DeviceTime`."""

    window: float = 40.0
    """[s] Length of the fit's window. A longer one averages better, a shorter one follows a quartz
    that warms up: at 0.5 ppm/s the ends of 40 s deviate by 0.1 ms."""
    bucket: float = 0.5
    """[s] The least delayed stamp of each bucket is kept; window / bucket is the memory."""
    drift: float = 250e-6
    """[-] Largest rate error between device and host. Quartzes of both ends are within 100e-6
    each."""
    slew: float = 2e-3
    """[-] Largest rate difference between mapped times and the device's clock while they approach a
    new fit: the error of dt in an integration of IMU samples."""
    haste: float = 10.0
    """[s] Errors above slew * haste decay with this time constant instead."""
    settling: float = 2.0
    """[s] Duration after the start, or after a silence longer than the window, in which the slew is
    0.5; for at least twenty stamps."""
    stray: float = 0.02
    """[s] Limit ahead of a settled fit above which a stamp needs a second one that agrees: it is a
    damaged number in a text, or the port was congested until then."""
    step: float = 0.5
    """[s] Limit ahead of the fit, or behind the newest stamp, above which the device's clock counts
    as set or restarted once a second stamp agrees."""
    patience: float = 5.0
    """[s] Stamps later than `step` for this long mean that the device's clock halted."""

    def __post_init__(self) -> None:
        for field in fields(self):
            if not getattr(self, field.name) > 0.0:
                raise ValueError(f"{field.name}: a number above 0 expected")
        if self.window < 2.0 * self.bucket:
            raise ValueError("window: at least two buckets expected")
