"""Compiled session for batches of environments, equivalent to `Session`.

The same messages at the same times give the same roles, stamps and ranges, which a test checks. It
leaves out features that a simulation of one group of distinct nodes does not need: bytes and
their errors, tables split over frames, other PANs, duplicate IDs (and so the muted role),
clocks that jump, antenna delays that the node knows, ranges overheard by third nodes and
those that the node with the larger ID computes a little later.

`p`, `s`, `peers` and `me` are as in `compiled.turns`.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel
from tracking.ranging.compiled.listening import forget_peers, take_message
from tracking.ranging.compiled.turns import (
    FRAME,
    INITIATOR,
    LISTENING,
    RESPONDER,
    SLOT,
    START,
    TAKEOVER,
    TURN,
    WATCHDOG,
    await_slot,
    count_bits,
    hold,
    listen,
    member_at,
    pause,
    random_bits,
    set_members,
    silent_slot,
    unreadable,
    wait,
)
from tracking.ranging.frames.timestamps import GRID

REQUEST, REPLY, JOIN = 1, 2, 3


@small_kernel
def switch_on(p, s, peers, me, boot, now):
    """Switch a node on as `Session.__init__` and `Session.start`."""
    s.boot = boot & 255
    s.dice = (boot * 2654435761 + me + 1) & 0xFFFFFFFF
    s.round = s.cursor = s.expected = 0
    s.opened = -1
    s.now = now
    begin(p, s, peers, me)


@small_kernel
def begin(p, s, peers, me):
    """Start again as `Session._begin`."""
    forget_peers(s, peers, me)
    set_members(s, 1 << me)
    s.role, s.root = LISTENING, me
    s.asked_before = s.asked_at = s.received_at = s.now
    s.check_at = s.attempts = s.backoff = 0
    s.tried_round = -1
    listen(p, s)


@small_kernel
def take_preamble(p, s, now):
    """Handle a preamble as `Session.preamble`."""
    s.now = max(now, s.now)
    hold(p, s)


@small_kernel
def take_broken(p, s, me, now):
    """Handle a broken frame as `Session.broken`."""
    s.now = max(now, s.now)
    if s.waiting == FRAME:
        unreadable(p, s, me)


@small_kernel
def take_timeout(p, s, peers, me, message, rows):
    """Handle the deadline as `Session.timeout`; the node may transmit."""
    s.now = max(s.deadline, s.now)
    waiting = s.waiting
    if waiting == FRAME:
        unreadable(p, s, me)
    elif waiting == SLOT:
        silent_slot(p, s, peers, me)
    elif waiting == WATCHDOG:
        begin(p, s, peers, me)
    else:
        at = max(s.expected, s.now + p.header)
        if waiting != TURN:  # START or TAKEOVER: become initiator
            set_members(s, s.members & ~((1 << me) - 1))
            s.role, s.root = INITIATOR, me
            s.asked_before = s.asked_at = s.now
            at = s.now + p.turnaround + p.header
        transmit(p, s, peers, me, message, rows, at)


@small_kernel
def take_frame(p, s, peers, me, src, message, rows, arrived, carrier, now):
    """Handle a valid frame as `Session.frame`, up to the time at which a newcomer may transmit.

    Returns:
        Whether a newcomer may transmit, after the frame; a distance [m], negative if none; the
        time of the distance.
    """
    s.now = max(now, s.now)
    hold(p, s)
    lost = s.before in (TAKEOVER, WATCHDOG, START)
    if s.role == LISTENING and message.root == me:
        wait(s, s.before, s.held_deadline)
        return False, -1.0, 0
    in_turn = message.type != JOIN
    follows = message.root == s.root and s.role != LISTENING
    taken, distance, time = False, -1.0, 0
    if follows or (in_turn and (message.root < s.root or lost)):
        taken, distance, time = take_message(p, s, peers, me, src, message, rows, arrived, carrier)
    if not taken:
        unreadable(p, s, me)
        return False, -1.0, 0
    s.received_at = s.now
    if in_turn:
        keep_step(s, me, message)
    s.expected = arrived + message.ticks + p.gap
    await_slot(p, s, me)
    newcomer = not (s.members >> me) & 1
    if not newcomer:
        s.attempts = s.backoff = 0
    return newcomer, distance, time


@small_kernel
def keep_step(s, me, message):
    """Keep in step as `Session._keep_step`."""
    in_step = message.root == s.root and message.round == s.round and message.n == s.n
    s.cursor = message.slot + 1
    if s.role == INITIATOR and message.root == me:
        if not in_step:
            s.cursor = s.n
        return
    if message.type == REQUEST or not in_step:
        set_members(s, message.members)
    s.round, s.root, s.role = message.round, message.root, RESPONDER
    if message.root == me:
        s.role = INITIATOR
        s.asked_before = s.asked_at = s.now


@small_kernel
def may_insert(p, s):
    """Return `Joining.may_transmit`, and schedule the check as `Session._insert`."""
    if s.round == s.tried_round:
        return False
    if s.backoff > 0:
        s.backoff -= 1
        return False
    s.attempts = min(s.attempts + 1, 5)
    s.backoff = random_bits(s, s.attempts)
    s.tried_round = s.round
    s.check_at = s.now + pause(s, p.first_check)
    return True


@small_kernel
def transmit(p, s, peers, me, message, rows, at):
    """Prepare a message as `Session._transmit`; it waits to be sent.

    Args:
        p: SessionNumbers.
        s: SESSION of this node, updated.
        peers: PEER, (node, node), updated.
        me: Number of this node.
        message: MESSAGE of this node, written.
        rows: Receive times of every node from each other one, its own clock, (node, node); the
            row of this node is written.
        at: Earliest stamp moment, own clock.
    """
    kind, root = JOIN, s.root
    if s.role == INITIATOR and s.cursor >= s.n:
        kind = REQUEST
        renew_members(p, s, peers, me)
        s.round = (s.round + 1) & 255
        s.cursor = 0
        s.asked_before, s.asked_at = s.asked_at, at
        root = member_at(s.members, 0)
    elif (s.members >> me) & 1:
        kind = REPLY
    at = -(-at // GRID) * GRID
    others = (s.members | s.fresh) & ~(1 << me)
    n_rows = 0 if kind == JOIN else count_bits(others)
    message.type, message.root, message.round = kind, root, s.round
    message.slot, message.n, message.boot = min(s.cursor, s.n), s.n, s.boot
    message.stamp, message.members = at, s.members
    message.stamped = 0 if kind == JOIN else s.fresh
    message.rows, message.ticks = n_rows, p.frame[n_rows]
    for k in range(peers.shape[0]):
        rows[me, k] = peers[me, k].received
    s.fresh = 0
    s.last_sent = at
    s.tx_pending, s.tx_at = True, at
    s.expected = at + message.ticks + p.gap
    if kind != JOIN:
        s.cursor += 1
    if kind == REQUEST and s.n == 1:
        s.expected += pause(s, p.idle)
    if root != s.root:
        s.role, s.root = RESPONDER, root
    await_slot(p, s, me)


@small_kernel
def renew_members(p, s, peers, me):
    """Decide the members as `Members.renew`."""
    members = s.members | 1 << me
    for k in range(peers.shape[0]):
        peer = peers[me, k]
        if not peer.known:
            continue
        if max(peer.received, peer.reported) > s.asked_before:
            peer.missed = 0
            members |= 1 << k
        else:
            peer.missed += 1
            if peer.missed >= p.drop_after:
                members &= ~(1 << k)
    set_members(s, members)
