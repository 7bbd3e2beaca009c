"""What is believed of the clocks of devices and of the way their bytes take."""

from __future__ import annotations

from dataclasses import dataclass, fields

NS = 1_000_000_000
"""[1/s] Nanoseconds in a second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockParams:
    """Of `DeviceTime`."""

    window: float = 40.0
    """[s] How far back the fit looks. Longer averages better, shorter follows a quartz that warms
    up: at 0.5 ppm/s the ends of 40 s bend by 0.1 ms."""
    bucket: float = 0.5
    """[s] The least delayed stamp of this long is kept; window / bucket is the memory."""
    drift: float = 250e-6
    """[-] Largest rate error that is believed, device against host. Quartzes of both ends are
    within 100e-6 each."""
    slew: float = 2e-3
    """[-] Times of measurements run this much faster or slower than the device while they move to
    a new fit: the error of dt that an integration of an IMU sees."""
    haste: float = 10.0
    """[s] Errors above slew * haste shrink with this time constant instead."""
    settling: float = 2.0
    """[s] At the start, and after a silence longer than the window, the slew is 0.5; for
    twenty stamps at least."""
    stray: float = 0.02
    """[s] A stamp this much ahead of a settled fit needs a second one that agrees: a damaged
    number in a text, or a port that was congested all the time before."""
    step: float = 0.5
    """[s] Ahead by more, or older than the newest by more: the device's clock was set or began
    again, once a second stamp agrees."""
    patience: float = 5.0
    """[s] Later than `step` for this long: the device's clock stood still."""

    def __post_init__(self) -> None:
        for field in fields(self):
            if not getattr(self, field.name) > 0.0:
                raise ValueError(f"{field.name}: a number above 0 expected")
        if self.window < 2.0 * self.bucket:
            raise ValueError("window: at least two buckets expected")
