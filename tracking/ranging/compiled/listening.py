"""Kernels of `listening`, `peers` and `exchange`: evaluation of received messages.

They store only pairs of the node itself, and return only ranges that the node with the smaller
number computes; `p`, `s`, `peers` and `me` are as in `compiled.turns`.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel
from tracking.ranging.compiled.exchange import (
    FIRST_VAR,
    NO_INTERVAL,
    exchange_distance,
    predict_skew,
    take_carrier,
    take_interval,
)
from tracking.ranging.peers import DOUBT, DRIFT, PATIENCE, SLACK


@small_kernel
def same_moment(a, b, span):
    """Return whether two times are one moment, as `Peers.same`."""
    return abs(a - b) <= SLACK + DRIFT * span


@small_kernel
def forget_exchange(peer):
    """Drop the exchanges of one pair as `Exchanges.forget`."""
    peer.asked = peer.answered = False
    peer.skew_time = peer.skew_misfits = 0
    peer.skew_mean = 0.0
    peer.skew_var = FIRST_VAR


@small_kernel
def forget_peers(s, peers, me):
    """Reset the peers as `Listener.forget`."""
    s.last_sent = 0
    s.fresh = 0
    for k in range(peers.shape[0]):
        peer = peers[me, k]
        peer.known = False
        peer.boot = peer.sent = peer.received = peer.reported = peer.missed = peer.misfits = 0
        peer.silences = peer.doubt = 0
        forget_exchange(peer)


@small_kernel
def take_stamp(peer, boot, stamp, arrived):
    """Update a peer as `Peers.take`: 1 if the clock continues, 0 if it restarts, -1 if not."""
    peer.known = True
    peer.doubt = DOUBT if peer.silences else max(peer.doubt - 1, 0)
    peer.silences = 0
    if peer.received and peer.boot == boot:
        own = arrived - peer.received
        if own > 0 and same_moment(stamp - peer.sent, own, own):
            peer.sent, peer.received, peer.misfits = stamp, arrived, 0
            return 1
        peer.misfits += 1
        if peer.misfits < PATIENCE:
            return -1
    peer.boot, peer.sent, peer.received, peer.misfits = boot, stamp, arrived, 0
    return 0


@small_kernel
def take_message(p, s, peers, me, src, message, rows, arrived, carrier):
    """Process a message as `Listener.take`.

    Args:
        p: SessionNumbers.
        s: SESSION of this node, updated.
        peers: PEER, (node, node), updated.
        me: Number of this node.
        src: Sender of the message.
        message: MESSAGE of the sender.
        rows: Receive times of every node from each other one, its own clock, (node, node).
        arrived: Receive time, own clock.
        carrier: Carrier offset [1].

    Returns:
        Whether it was accepted; the distance to `src` [m], negative if none was completed; its
        time, own clock.
    """
    peer = peers[me, src]
    goes_on = take_stamp(peer, message.boot, message.stamp, arrived)
    if goes_on < 0:
        return False, -1.0, 0
    if goes_on == 0:
        forget_exchange(peer)
    s.fresh |= 1 << src
    stamped = message.stamped
    k = 0
    while stamped:
        if stamped & 1:
            ago = message.stamp - rows[src, k]
            if ago > 0:
                when = arrived - ago
                if k != me:
                    other = peers[me, k]
                    other.known = True
                    other.reported = max(other.reported, when)
                elif s.last_sent and same_moment(when, s.last_sent, ago) and me < src:
                    peer.asked = True
                    peer.asked_sent = s.last_sent
                    peer.asked_received = peer.sent - ago
        stamped >>= 1
        k += 1
    if me > src:
        return True, -1.0, 0
    return complete(p.exchange, peer, arrived, carrier)


@small_kernel
def complete(p, peer, arrived, carrier):
    """Complete an exchange as `Exchanges.carrier` and `Exchanges.add` for the receiver."""
    if peer.skew_time:
        peer.skew_var = predict_skew(p, peer.skew_var, arrived - peer.skew_time)
    peer.skew_mean, peer.skew_var = take_carrier(p, peer.skew_mean, peer.skew_var, carrier)
    peer.skew_time = arrived
    received = arrived - peer.answered_received if peer.answered else 0
    sent = peer.sent - peer.answered_sent if peer.answered else 0
    fit, skew, peer.skew_mean, peer.skew_var, peer.skew_misfits = take_interval(
        p, peer.skew_mean, peer.skew_var, peer.skew_misfits, received, sent
    )
    if not peer.answered:
        fit = NO_INTERVAL
    peer.answered, peer.answered_sent, peer.answered_received = True, peer.sent, arrived
    if not peer.asked:
        return True, -1.0, 0
    peer.asked = False
    distance = exchange_distance(
        p,
        arrived - peer.asked_sent,
        peer.sent - peer.asked_received,
        fit,
        skew,
        peer.skew_mean,
        peer.skew_var,
    )
    return True, distance if distance > 0.0 else -1.0, peer.asked_sent
