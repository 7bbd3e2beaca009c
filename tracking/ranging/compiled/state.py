"""Records of the compiled session: the memory of `Session` and its parts, node by node."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracking.arrays import I64
from tracking.ranging.compiled.exchange import FIRST_VAR, ExchangeNumbers
from tracking.ranging.frames.airtime import table_bytes
from tracking.ranging.frames.slots import Slots
from tracking.ranging.frames.timestamps import ticks
from tracking.ranging.params import SessionParams

Records = NDArray[Any]
SESSION = np.dtype(
    [
        ("role", "i8"),
        ("root", "i8"),
        ("round", "i8"),
        ("boot", "i8"),
        ("members", "i8"),  # bit k: node k
        ("n", "i8"),  # their number
        ("now", "i8"),
        ("asked_before", "i8"),
        ("asked_at", "i8"),
        ("attempts", "i8"),
        ("backoff", "i8"),
        ("tried_round", "i8"),  # -1: none
        ("dice", "i8"),
        # Turns
        ("cursor", "i8"),
        ("expected", "i8"),
        ("waiting", "i8"),
        ("before", "i8"),
        ("deadline", "i8"),
        ("held_deadline", "i8"),
        ("received_at", "i8"),
        ("check_at", "i8"),
        ("early", "?"),
        ("opened", "i8"),
        # Listener and Transmitter
        ("last_sent", "i8"),
        ("fresh", "i8"),  # bit k: received since the own last message
        ("tx_pending", "?"),  # a message is waiting to be sent, or is being sent
        ("tx_at", "i8"),
    ]
)
"""State of one node."""

PEER = np.dtype(
    [
        ("known", "?"),
        ("boot", "i8"),
        ("sent", "i8"),
        ("received", "i8"),
        ("reported", "i8"),
        ("missed", "i8"),
        ("misfits", "i8"),
        ("silences", "i8"),
        ("doubt", "i8"),
        # Exchanges of the pair, used where the keeper has the smaller number
        ("asked", "?"),
        ("asked_sent", "i8"),
        ("asked_received", "i8"),
        ("answered", "?"),
        ("answered_sent", "i8"),
        ("answered_received", "i8"),
        ("skew_time", "i8"),
        ("skew_mean", "f8"),
        ("skew_var", "f8"),
        ("skew_misfits", "i8"),
    ]
)
"""State of one node about another."""

MESSAGE = np.dtype(
    [
        ("type", "i8"),
        ("root", "i8"),
        ("round", "i8"),
        ("slot", "i8"),
        ("n", "i8"),
        ("boot", "i8"),
        ("stamp", "i8"),  # sender's clock without wraps
        ("members", "i8"),  # first rows of the table; with the sender if it is a member
        ("stamped", "i8"),  # bit k: row k has a stamp
        ("rows", "i8"),  # length of the table
        ("ticks", "i8"),  # time on the air
    ]
)
"""A sent message in place of its bytes; the stamps of its rows are stored separately."""


class SessionNumbers(NamedTuple):
    """`SessionParams` and `Slots` in ticks and plain numbers."""

    header: int
    sense: int
    turnaround: int
    gap: int
    silent: int
    join: int
    longest: int
    succession: bool
    takeover: float
    watchdog: int
    listen: tuple[int, int]
    idle: tuple[int, int]
    first_check: tuple[int, int]
    check: tuple[int, int]
    drop_after: int
    exchange: ExchangeNumbers
    frame: I64
    """Duration of a frame with k rows, (k) [ticks]."""
    message: I64
    """Duration of a message with its gap in a group of n nodes, (n) [ticks]."""


def session_numbers(params: SessionParams, n_nodes: int) -> SessionNumbers:
    """Derive the numbers of the kernels.

    Args:
        params: As for `Session`; the antenna delay and the PAN have no effect.
        n_nodes: Size of the group, at most `MAX_MEMBERS`, whose table fits into one frame.
    """
    slots = Slots(params.phy)

    def interval(seconds: tuple[float, float]) -> tuple[int, int]:
        return ticks(seconds[0]), ticks(seconds[1])

    most = min(n_nodes, params.phy.room)
    return SessionNumbers(
        slots.header,
        slots.sense,
        slots.turnaround,
        slots.gap,
        slots.silent,
        slots.join,
        slots.longest,
        params.succession,
        params.takeover,
        ticks(params.watchdog),
        interval(params.listen),
        interval(params.idle),
        interval(params.first_check),
        interval(params.check),
        params.drop_after,
        params.exchange.numbers(),
        np.array([slots.frame(table_bytes(params.phy, k)) for k in range(most + 1)]),
        np.array([0] + [slots.message(n) for n in range(1, n_nodes + 1)]),
    )


def make_sessions(n_envs: int, n_nodes: int) -> tuple[Records, Records]:
    """Return SESSION (env, node) and PEER (env, node, node), all switched off."""
    peers = np.zeros((n_envs, n_nodes, n_nodes), dtype=PEER)
    peers["skew_var"] = FIRST_VAR
    return np.zeros((n_envs, n_nodes), dtype=SESSION), peers
