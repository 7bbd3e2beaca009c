"""What a node knows from the messages that it receives: for simulated trackers on each node.

The compiled session computes a range at its asker only. Third nodes, and the answerer, compute it
from the same stamps one message of the asker later. Left out: exchanges whose question is older
than the asker's last message, which they complete after a loss.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tracking.arrays import F64, I64
from tracking.kernels.jit import small_kernel

RANGE, RECEIVED_MESSAGE = 5, -1
"""Kinds of events; `RECEIVED_MESSAGE`: a received message."""
POWER_TOP, POWER_STEP, MOST_STEPS, MOST_GAP = -60.0, 3.0, 14, 15
"""Steps of the powers in a table [dBm, dB], see `tracking.ranging.frames.wire`."""


class Overheard(NamedTuple):
    """What each node knows from its radio, (env, slot), and the memory that this needs.

    A node knows a range of two others after three messages: the question, the answer, and the
    next message of the asker, whose table has the reception of the answer.
    """

    t: F64
    """Time of the range, or of the received message [s]."""
    kind: I64
    """`Kind.RANGE`, or `RECEIVED_MESSAGE` for a received message."""
    receiver: I64
    i: I64
    """The node with the smaller number, or the sender of the message."""
    j: I64
    values: F64
    """Distance [m], received and first-path power [dBm], (env, slot, 3)."""
    used: I64
    """Number of events, (env); the reader sets it to 0."""
    last: I64
    """Number of the last message received, (env, receiver, sender)."""
    question: I64
    """Numbers of the messages of the last range of a pair, (env, asker, answerer)."""
    answer: I64
    time: F64
    """Time of the last range of a pair, (env, asker, answerer) [s]."""
    measured: F64
    """Distance [m] and powers [dBm] of the last range of a pair, (env, asker, answerer, 3)."""


def make_overheard(n_envs: int, n_nodes: int, room: int) -> Overheard:
    """Return an empty buffer; with room 0 nothing is written."""

    def ints(*shape: int) -> I64:
        return np.zeros((n_envs, *shape), dtype=np.int64)

    slots, pairs = (n_envs, room), (n_nodes, n_nodes)
    return Overheard(
        np.zeros(slots), ints(room), ints(room), ints(room), ints(room), np.zeros((*slots, 3)),
        ints(), ints(*pairs), ints(*pairs), ints(*pairs), np.zeros((n_envs, *pairs)),
        np.zeros((n_envs, *pairs, 3)),
    )  # fmt: skip


@small_kernel
def note_resolved(over, e, i, j, question, answer, t, distance, rx_power, fp_power):
    """Record a range at the asker i, which knows it at once; t is its time [s]."""
    over.question[e, i, j], over.answer[e, i, j] = question, answer
    over.time[e, i, j] = t
    measured = over.measured
    measured[e, i, j, 0], measured[e, i, j, 1], measured[e, i, j, 2] = distance, rx_power, fp_power
    append(over, e, RANGE, i, i, j, t, distance, rx_power, fp_power)


@small_kernel
def note_message(over, e, receiver, sender, number, has_table, t):
    """Record a received message, and the ranges of its sender that it completes.

    Args:
        over: Overheard, updated.
        e: Index of the environment.
        receiver: Node that received it.
        sender: Node that sent it.
        number: Number of the message at its sender, from 1.
        has_table: True if the message has a table, and so a motion.
        t: Time of its stamp [s].
    """
    last = over.last
    if has_table:
        append(over, e, RECEIVED_MESSAGE, receiver, sender, sender, t, 0.0, 0.0, 0.0)
    if has_table and number > 1 and last[e, receiver, sender] == number - 1:
        for j in range(sender + 1, last.shape[1]):
            if over.question[e, sender, j] != number - 1:
                continue
            if receiver != j and last[e, receiver, j] != over.answer[e, sender, j]:
                continue
            distance, rx = over.measured[e, sender, j, 0], over.measured[e, sender, j, 1]
            rx, fp = table_powers(rx, over.measured[e, sender, j, 2])
            at = over.time[e, sender, j]
            append(over, e, RANGE, receiver, sender, j, at, distance, rx, fp)
    last[e, receiver, sender] = number


@small_kernel
def table_powers(rx_power, fp_power):
    """Return received and first-path power as a table has them [dBm]."""
    steps = min(max(math.floor((POWER_TOP - rx_power) / POWER_STEP + 0.5), 0.0), MOST_STEPS)
    rx = POWER_TOP - POWER_STEP * steps
    return rx, rx - min(max(math.floor(rx_power - fp_power + 0.5), 0.0), MOST_GAP)


@small_kernel
def append(over, e, kind, receiver, i, j, t, distance, rx_power, fp_power):
    """Append an event to the buffer."""
    k = over.used[e]
    if k >= over.t.shape[1]:
        return
    over.t[e, k], over.kind[e, k], over.receiver[e, k] = t, kind, receiver
    over.i[e, k], over.j[e, k] = i, j
    over.values[e, k, 0], over.values[e, k, 1], over.values[e, k, 2] = distance, rx_power, fp_power
    over.used[e] = k + 1
