"""How long a message is on the air, and how often a round of ranging can be had.

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Phy:
    """One radio setting and the message that is sent with it."""

    preamble_symbols: int = 1024
    """[-] Longer reaches farther and takes longer."""
    sfd_symbols: int = 64
    """[-]"""
    symbol: float = 496 / 499.2e6
    """[s] One preamble symbol at 16 MHz pulse repetition."""
    bit: float = 8.2051e-6
    """[s] One bit of header at the low rate, 110 kbit/s; also of payload."""
    fixed_bytes: int = 16
    """[-] MAC header 9, own transmit time stamp 5, check sum 2."""
    bytes_per_node: int = 7
    """[-] Receive time stamp 5, id and quality 2."""
    gap: float = 0.0
    """[s] Silence between two messages."""


PAPER_PHY = Phy()
"""The setting of the paper: DW1000, 110 kbit/s, preamble 1024, 16 MHz."""

PHR_BITS = 21
PARITY_BITS = 48
BLOCK_BITS = 330


def airtime(phy: Phy, payload_bytes: int) -> float:
    """Time that a message of so many bytes is on the air [s]."""
    data = 8 * payload_bytes
    coded = data + PARITY_BITS * math.ceil(data / BLOCK_BITS)
    preamble = (phy.preamble_symbols + phy.sfd_symbols) * phy.symbol
    return preamble + (PHR_BITS + coded) * phy.bit


def message_time(phy: Phy, n_nodes: int) -> float:
    """Time from one message of a round to the next, n nodes in the group [s]."""
    return airtime(phy, phy.fixed_bytes + phy.bytes_per_node * n_nodes) + phy.gap


def round_rate(phy: Phy, n_nodes: int) -> float:
    """Rounds per second in which every pair is ranged once [Hz]."""
    return 1.0 / (n_nodes * message_time(phy, n_nodes))
