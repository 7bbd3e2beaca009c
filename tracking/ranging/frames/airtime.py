"""Time of a message on the air, and rate of ranging rounds.

A UWB frame [1] is a preamble of symbols, a start-of-frame delimiter (SFD), a header (PHR) of
21 bits and the payload, to which Reed-Solomon coding adds 48 parity bits for every 330 bits.
In a round every one of n nodes sends one message, which carries the time stamps of all:

    f = 1 / (n t_msg)                                          ([2] eq. 4)

References:
    [1] IEEE 802.15.4-2011, clause 14; DW1000 User Manual, sections 3 and 9.
    [2] Armani, Holz, ICRA 2024.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from tracking.errors import ConfigError
from tracking.ranging.frames.motion import MOTION_BYTES
from tracking.ranging.frames.wire import ENTRY_BYTES, FIXED_BYTES, entries_per_frame

PHR_BITS = 21
PARITY_BITS = 48
BLOCK_BITS = 330


@dataclass(frozen=True, slots=True, kw_only=True)
class Phy:
    """A radio setting, and the pauses that the radio needs between messages."""

    name: str
    preamble_symbols: int
    """[-] Preamble symbols; more reach farther and take longer."""
    sfd_symbols: int
    """[-] Symbols of the SFD."""
    header_bit: float
    """[s] Duration of one bit of the PHR."""
    data_bit: float
    """[s] Duration of one bit of payload."""
    symbol: float = 496 / 499.2e6
    """[s] Duration of one preamble symbol at 16 MHz pulse repetition."""
    detect: float = 32e-6
    """[s] Preamble that a receiver needs for detection: two chunks of 16 symbols."""
    sense: float = 48e-6
    """[s] Listening time that distinguishes silence from a preamble: another chunk."""
    turnaround: float = 12e-6
    """[s] Time from reception to transmission."""
    processing: float = 0.0
    """[s] Time from the end of a message until the answer is loaded, which is ordered after
    `sense`. 0 if the payload can be written during the own preamble, 1 ms long."""
    max_frame: int = 127
    """[bytes] Longest frame; up to 1023 with the long frames of the DW1000."""
    motion_bytes: int = 0
    """[bytes] Preintegrated motion in every message with a table, see `frames.motion`: 0 or 24."""

    def __post_init__(self) -> None:
        if self.motion_bytes not in (0, MOTION_BYTES):
            raise ConfigError(
                f"motion_bytes: expected 0 or {MOTION_BYTES}, got {self.motion_bytes}"
            )
        least = FIXED_BYTES + ENTRY_BYTES + self.motion_bytes
        if not least <= self.max_frame <= 1023:
            raise ConfigError(f"max_frame: expected {least} to 1023 bytes, got {self.max_frame}")
        if not 0.0 < self.turnaround + self.detect < self.sense:
            raise ConfigError(
                f"sense: expected more than turnaround and detect, got {self.sense} s"
            )

    @property
    def gap(self) -> float:
        """Silence between two messages, in which all nodes listen for newcomers [s]."""
        return max(self.sense + self.turnaround, self.processing)

    @property
    def room(self) -> int:
        """Number of table rows that fit into a frame [-]."""
        return entries_per_frame(self.max_frame - self.motion_bytes)

    @property
    def header_time(self) -> float:
        """Time from the start of a frame to the moment of its time stamp [s]."""
        return (self.preamble_symbols + self.sfd_symbols) * self.symbol


PAPER_PHY = Phy(
    name="110k",
    preamble_symbols=1024,
    sfd_symbols=64,
    header_bit=8.2051e-6,
    data_bit=8.2051e-6,
)
"""The setting of the paper: DW1000, 110 kbit/s, preamble 1024, 16 MHz."""

FAST_PHY = Phy(
    name="6M8",
    preamble_symbols=128,
    sfd_symbols=8,
    header_bit=1.02564e-6,
    data_bit=0.128205e-6,
    detect=16e-6,
    sense=32e-6,
    processing=300e-6,
)
"""6.8 Mbit/s, preamble 128: eight times the rate, and a shorter range."""

PHYS = {phy.name: phy for phy in (PAPER_PHY, FAST_PHY)}


def table_bytes(phy: Phy, entries: int) -> int:
    """Return the bytes of the last frame of a message, which has the motion, if it has a table."""
    return FIXED_BYTES + ENTRY_BYTES * entries + (phy.motion_bytes if entries else 0)


def airtime(phy: Phy, frame_bytes: int) -> float:
    """Return the time on the air of a frame of `frame_bytes` bytes [s]."""
    data = 8 * frame_bytes
    coded = data + PARITY_BITS * math.ceil(data / BLOCK_BITS)
    return phy.header_time + PHR_BITS * phy.header_bit + coded * phy.data_bit


def message_time(phy: Phy, n_nodes: int) -> float:
    """Return the time from one message of a round to the next, for n nodes [s]."""
    left, total = n_nodes - 1, 0.0
    while True:
        entries = min(left, phy.room)
        left -= entries
        frame = table_bytes(phy, entries) if left <= 0 else FIXED_BYTES + ENTRY_BYTES * entries
        total += airtime(phy, frame) + phy.gap
        if left <= 0:
            return total


def round_rate(phy: Phy, n_nodes: int) -> float:
    """Return the rate of rounds, in each of which every pair is ranged once [Hz]."""
    return 1.0 / (n_nodes * message_time(phy, n_nodes))
