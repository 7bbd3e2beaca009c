"""What maps the stamps of one stream to the host's clock."""

from __future__ import annotations

from typing import Protocol


class StreamTime(Protocol):
    """The times of one device's measurements."""

    def map(self, ticks: int | None, arrival_ns: int) -> int:
        """Host time at which something was measured.

        Args:
            ticks: The device's stamp; None where the message has none.
            arrival_ns: When its bytes came, by the host's monotonic clock [ns]; never earlier
                than that of the call before.

        Returns:
            Host time [ns], never after the arrival.
        """

    def restart(self) -> None:
        """The device started again: its counter too."""


class HostTime:
    """Of formats without time: measured when it came."""

    def map(self, ticks: int | None, arrival_ns: int) -> int:
        """The arrival."""
        return arrival_ns

    def restart(self) -> None:
        """Changes nothing."""
