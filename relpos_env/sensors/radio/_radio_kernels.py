"""Compiled messages of all environments; `air` is the reference implementation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from relpos_env.sensors.radio._path_kernels import (
    distance_moved,
    enter_next_window,
    read_clock,
    receive,
    true_time,
)
from tracking.kernels.jit import kernel, small_kernel
from tracking.ranging.compiled.overheard import note_message, note_resolved
from tracking.ranging.compiled.session import (
    may_insert,
    switch_on,
    take_broken,
    take_frame,
    take_preamble,
    take_timeout,
    transmit,
)

NOTHING, END, DETECT, DEADLINE = -1, 0, 1, 2


class Air(NamedTuple):
    """State of the nodes of a batch and of their messages, arrays over (env, ...)."""

    nodes: np.ndarray
    """NODE, (env, node)."""
    latents: np.ndarray
    """LATENT, (env, node, node)."""
    sessions: np.ndarray
    """SESSION, (env, node)."""
    peers: np.ndarray
    """PEER, (env, node, node)."""
    messages: np.ndarray
    """MESSAGE, (env, node)."""
    rows: np.ndarray
    """Stamps of the tables, (env, node, node) [ticks]."""
    receptions: np.ndarray
    """RECEPTION, (env, node + 1); the last one is scratch."""
    flights: np.ndarray
    """FLIGHT, (env, node)."""
    due: np.ndarray
    """Deadlines since the start of the window, (env, node) [s]."""
    channel: np.ndarray
    """CHANNEL, (env)."""
    seeds: np.ndarray
    """Seeds, uint64, (env)."""
    window: np.ndarray
    """Number of completed windows, (env)."""


class OneAir(NamedTuple):
    """State of one environment."""

    nodes: np.ndarray
    """NODE, (node)."""
    latents: np.ndarray
    """LATENT, (node, node)."""
    sessions: np.ndarray
    """SESSION, (node)."""
    peers: np.ndarray
    """PEER, (node, node)."""
    messages: np.ndarray
    """MESSAGE, (node)."""
    rows: np.ndarray
    """Stamps of the tables, (node, node) [ticks]."""
    receptions: np.ndarray
    """RECEPTION, (node + 1); the last one is scratch."""
    flights: np.ndarray
    """FLIGHT, (node)."""
    due: np.ndarray
    """Deadlines since the start of the window, (node) [s]."""


class Scene(NamedTuple):
    """Antennas and obstacles during a window."""

    pos0: np.ndarray
    """Antennas at the start of the window, (node, 3) [m]."""
    pos1: np.ndarray
    """Antennas at the end of the window, (node, 3) [m]."""
    boxes: np.ndarray
    """Obstacles in the plane, (box, 6)."""
    capsules: np.ndarray
    """Obstacles in 3D, (capsule, 7)."""


@kernel
def run_window(p, radio, batch, scenes, dt, out, over):
    """Simulate the messages of all environments for one window.

    Args:
        p: SessionNumbers.
        radio: RadioNumbers.
        batch: Air of all environments, updated.
        scenes: Scene of all environments.
        dt: Length of the window [s].
        out: RangeBuffer, written; it must hold the largest number of ranges of a window.
        over: Overheard, appended.
    """
    for e in range(batch.seeds.shape[0]):
        run_env_window(p, radio, batch, scenes, dt, out, over, e)


@kernel
def run_env_window(p, radio, batch, scenes, dt, out, over, e):
    """Simulate the messages of environment e for one window; arguments as for `run_window`."""
    air = OneAir(
        batch.nodes[e],
        batch.latents[e],
        batch.sessions[e],
        batch.peers[e],
        batch.messages[e],
        batch.rows[e],
        batch.receptions[e],
        batch.flights[e],
        batch.due[e],
    )
    scene = Scene(scenes.pos0[e], scenes.pos1[e], scenes.boxes[e], scenes.capsules[e])
    seed, c = batch.seeds[e], batch.channel[e]
    n, start = air.nodes.shape[0], batch.window[e] * dt
    out.used[e] = 0
    for k in range(n):
        air.nodes[k].step = distance_moved(scene, k)
        plan(air, k)
    while True:
        what, k, t = next_event(air, dt)
        if what == NOTHING:
            break
        if what == DETECT:
            air.flights[k].detect = np.inf
            for r in range(n):
                detect(p, radio, c, seed, air, scene, k, r, t, dt)
        elif what == DEADLINE:
            take_timeout(p, air.sessions[k], air.peers, k, air.messages[k], air.rows)
            launch(radio, air, k)
        else:
            end_message(p, radio, c, seed, air, scene, k, t, dt, out, over, start, e)
    close_window(radio, air, seed, batch.window[e], dt)
    batch.window[e] += 1


@kernel
def power_nodes(p, batch, e, k, on, boot, t):
    """Switch one node on or off at a time since the start of the coming window [s]."""
    node, session = batch.nodes[e, k], batch.sessions[e, k]
    flight = batch.flights[e, k]
    batch.receptions[e, k].src = -1
    if flight.active and flight.detect == np.inf:
        for r in range(batch.nodes.shape[1]):
            if batch.receptions[e, r].src == k:
                batch.receptions[e, r].bad = True
    else:
        flight.active, flight.detect, flight.end = False, np.inf, np.inf
    node.on, node.since = on, t
    if on:
        switch_on(p, session, batch.peers[e], k, boot, read_clock(node, t))


@small_kernel
def plan(air, k):
    """Update the due time of a node's deadline."""
    node = air.nodes[k]
    air.due[k] = true_time(node, air.sessions[k].deadline) if node.on else np.inf


@small_kernel
def next_event(air, dt):
    """Return kind, node and time of the next event in the window; the lower kind wins ties."""
    best, what, which = dt, NOTHING, 0
    for k in range(air.flights.shape[0]):
        if air.flights[k].end <= best and (what != END or air.flights[k].end < best):
            best, what, which = air.flights[k].end, END, k
    for k in range(air.flights.shape[0]):
        t = air.flights[k].detect
        if t < best or (t == best and what == NOTHING):
            best, what, which = t, DETECT, k
    for k in range(air.due.shape[0]):
        t = air.due[k]
        if t < best or (t == best and what == NOTHING):
            best, what, which = t, DEADLINE, k
    return what, which, best


@small_kernel
def launch(radio, air, k):
    """Start the pending transmission of a session, if any, and update its deadline."""
    session, node, flight = air.sessions[k], air.nodes[k], air.flights[k]
    if session.tx_pending:
        session.tx_pending = False
        flight.active = True
        flight.moment = true_time(node, session.tx_at)
        start = flight.moment - radio.header_time
        flight.detect = start + radio.detect
        flight.end = start + radio.airtime[air.messages[k].rows]
    plan(air, k)


@small_kernel
def detect(p, radio, c, seed, air, scene, s, r, t, dt):
    """Lock a free receiver on a message, which may corrupt the message of a busy receiver."""
    node = air.nodes[r]
    if r == s or not node.on or t < node.since or air.flights[r].active:
        return
    scratch, rx = air.receptions[air.nodes.shape[0]], air.receptions[r]
    moment = air.flights[s].moment
    lo, hi = min(s, r), max(s, r)
    if not receive(
        c, air.latents[lo, hi], seed, air.nodes[s], node, s, r, moment,
        scene.pos0, scene.pos1, dt, scene.boxes, scene.capsules, r < s, scratch,
    ):  # fmt: skip
        return
    if rx.src >= 0:
        rx.bad = rx.bad or scratch.strength > rx.strength - radio.capture
        return
    rx.src, rx.bad, rx.nlos = s, False, scratch.nlos
    rx.stamp, rx.strength, rx.carrier = scratch.stamp, scratch.strength, scratch.carrier
    rx.rx_power, rx.fp_power = scratch.rx_power, scratch.fp_power
    take_preamble(p, air.sessions[r], read_clock(node, t))
    plan(air, r)


@small_kernel
def end_message(p, radio, c, seed, air, scene, s, t, dt, out, over, start, e):
    """End a message: deliver it to the radios locked on it and free these for other ones."""
    n, overhears = air.nodes.shape[0], over.t.shape[1] > 0
    air.flights[s].active, air.flights[s].end = False, np.inf
    air.nodes[s].sent += 1
    free = 1 << s
    for r in range(n):
        rx, session = air.receptions[r], air.sessions[r]
        if rx.src != s:
            continue
        rx.src = -1
        free |= 1 << r
        now = read_clock(air.nodes[r], t)
        if rx.bad:
            take_broken(p, session, r, now)
        else:
            newcomer, distance, time = take_frame(
                p, session, air.peers, r, s, air.messages[s], air.rows, rx.stamp, rx.carrier, now
            )
            if distance > 0.0:
                note_range(air, r, s, distance, time, rx, out, e)
            if overhears and session.received_at == session.now:
                has_table, moment = air.messages[s].rows > 0, start + air.flights[s].moment
                note_message(over, e, r, s, air.nodes[s].sent, has_table, moment)
                if distance > 0.0:
                    at = start + true_time(air.nodes[r], time)
                    note_resolved(
                        over, e, r, s, air.nodes[r].sent, air.nodes[s].sent, at, distance,
                        rx.rx_power, rx.fp_power,
                    )  # fmt: skip
            if newcomer and may_insert(p, session):
                at = rx.stamp + air.messages[s].ticks + p.turnaround
                transmit(p, session, air.peers, r, air.messages[r], air.rows, at)
        launch(radio, air, r)
    for m in range(n):
        flight = air.flights[m]
        # A preamble that lasts long enough can still be detected.
        if flight.active and flight.detect == np.inf and t < flight.moment - radio.detect:
            for r in range(n):
                if (free >> r) & 1 and air.receptions[r].src < 0:
                    detect(p, radio, c, seed, air, scene, m, r, t, dt)


@small_kernel
def note_range(air, i, j, distance, time, rx, out, e):
    """Append a range to the buffer."""
    k = out.used[e]
    if k < out.t.shape[1]:
        out.t[e, k] = true_time(air.nodes[i], time)
        out.i[e, k], out.j[e, k] = i, j
        out.values[e, k, 0] = distance
        out.values[e, k, 1], out.values[e, k, 2] = rx.rx_power, rx.fp_power
        out.nlos[e, k] = rx.nlos
        out.used[e] = k + 1


@small_kernel
def close_window(radio, air, seed, window, dt):
    """Advance the nodes to the start of the next window and shift all times to it."""
    for k in range(air.nodes.shape[0]):
        node, flight = air.nodes[k], air.flights[k]
        enter_next_window(node, seed, window, k, dt, radio.wander)
        node.since -= dt
        if flight.active:
            flight.moment -= dt
            flight.detect -= dt
            flight.end -= dt
