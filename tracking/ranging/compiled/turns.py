"""Kernels of `turns`, `dice` and `members`; bit k of an integer is node k.

`p` is a `SessionNumbers`, `s` the SESSION of node `me`, `peers` PEER (node, node) of its
environment everywhere.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel
from tracking.ranging.peers import ELSEWHERE, MAX_SILENCES
from tracking.ranging.turns import CHECK_ROUNDS, OPEN

LISTENING, INITIATOR, RESPONDER = 0, 1, 2
START, FRAME, TURN, SLOT, TAKEOVER, WATCHDOG = 0, 1, 2, 3, 4, 5


@small_kernel
def count_bits(mask):
    """Return the number of members in a set."""
    count = 0
    while mask:
        mask &= mask - 1
        count += 1
    return count


@small_kernel
def place_of(mask, node):
    """Return the number of members with smaller numbers than a node."""
    return count_bits(mask & ((1 << node) - 1))


@small_kernel
def member_at(mask, place):
    """Return the number of the member at a place."""
    for _ in range(place):
        mask &= mask - 1
    return count_bits((mask & -mask) - 1)


@small_kernel
def set_members(s, mask):
    """Set the members."""
    s.members = mask
    s.n = count_bits(mask)


@small_kernel
def random_bits(s, n):
    """Return random bits as `Dice.bits`."""
    s.dice = (1664525 * s.dice + 1013904223) & 0xFFFFFFFF
    return s.dice >> (32 - n)


@small_kernel
def pause(s, interval):
    """Return a pause as `Dice.pause`."""
    return interval[0] + ((random_bits(s, 20) * (interval[1] - interval[0])) >> 20)


@small_kernel
def wait(s, waiting, deadline):
    """Wait as `Turns.wait`."""
    s.waiting = waiting
    s.deadline = deadline


@small_kernel
def hold(p, s):
    """Wait for a frame as `Turns.hold`."""
    if s.waiting != FRAME:
        s.before = s.waiting
        s.held_deadline = s.deadline
        s.early = s.now < s.expected - p.header
    wait(s, FRAME, s.now + p.longest + p.header)


@small_kernel
def await_slot(p, s, me):
    """Wait for the next slot as `Turns.await_slot`."""
    leads = s.role == INITIATOR
    mine = leads if s.cursor >= s.n else member_at(s.members, s.cursor) == me
    if s.cursor >= s.n and s.round % OPEN == OPEN - 1 and s.round != s.opened:
        s.opened = s.round
        if leads:
            s.expected += p.join
        elif s.attempts > 1 and not (s.members >> me) & 1:
            mine = True
    if mine and s.now >= s.check_at:
        rounds = CHECK_ROUNDS * s.n * p.message[s.n]
        s.check_at = s.now + max(pause(s, p.check), rounds)
        mine = leads
        if leads:
            s.expected += p.message[s.n]
    if mine:
        wait(s, TURN, s.expected - p.header - p.gap + p.sense)
    else:
        wait(s, SLOT, s.expected - p.header + p.sense)


@small_kernel
def silent_slot(p, s, peers, me):
    """Handle a silent slot as `Session._silent_slot` and `Turns.silent`."""
    missing = s.cursor >= s.n
    node = s.root if missing else member_at(s.members, s.cursor)
    since = s.now - 2 * s.n * p.message[s.n]
    peer = peers[me, node]
    waits = False
    if node != me and peer.known:
        waits = peer.reported > max(peer.received + ELSEWHERE, since)
    if missing and not waits:
        request_missing(p, s, me)
        return
    if node != me and peer.known and not missing:
        peer.silences += 1
        waits = waits or (peer.doubt > 0 and peer.silences <= MAX_SILENCES)
    s.expected += p.message[s.n] if waits else p.silent
    if missing:
        s.cursor = 1
        s.round = (s.round + 1) & 255
    else:
        s.cursor += 1
    await_slot(p, s, me)


@small_kernel
def request_missing(p, s, me):
    """Wait for a takeover as `Turns.request_missing`."""
    wait(s, WATCHDOG, s.received_at + p.watchdog)
    if p.succession and me != s.root and (s.members >> me) & 1:
        heirs = s.members & ~(1 << s.root)
        patience = p.takeover * (place_of(heirs, me) + 1)
        takeover = s.expected + int(patience * p.message[s.n])
        if takeover < s.deadline:
            wait(s, TAKEOVER, takeover)


@small_kernel
def unreadable(p, s, me):
    """Handle noise as `Session._unreadable` and `Turns.unreadable`."""
    if s.role == LISTENING:
        if s.now < s.received_at + p.watchdog:
            listen(p, s)
        else:
            wait(s, s.before, s.held_deadline)
        return
    if s.role == INITIATOR and random_bits(s, 2) == 0:
        s.check_at = s.now
    s.expected = s.now + p.gap + p.header
    if not s.early:
        s.cursor = 1 if s.cursor >= s.n and s.role == RESPONDER else s.cursor + 1
    if s.before in (TAKEOVER, WATCHDOG):
        request_missing(p, s, me)
    else:
        await_slot(p, s, me)


@small_kernel
def listen(p, s):
    """Listen as `Session._listen`."""
    wait(s, START, s.now + pause(s, p.listen))
