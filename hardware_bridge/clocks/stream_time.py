"""Protocol of the conversion of a stream's stamps to the host's clock."""

from __future__ import annotations

from typing import Protocol


class StreamTime(Protocol):
    """Host times of one device's measurements."""

    def map(self, ticks: int | None, arrival_ns: int) -> int:
        """Return the host time of a measurement.

        Args:
            ticks: The device's stamp; None if the message has none.
            arrival_ns: Arrival of its bytes, by the host's monotonic clock [ns]; never earlier than
                that of the previous call.

        Returns:
            Host time [ns], never after the arrival.
        """

    def restart(self) -> None:
        """Handle a restart of the device and its counter."""


class HostTime:
    """Times of formats without stamps: measured on arrival."""

    def map(self, ticks: int | None, arrival_ns: int) -> int:
        """Return the arrival."""
        return arrival_ns

    def restart(self) -> None:
        """Do nothing."""
