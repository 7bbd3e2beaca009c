"""Events that every car's own tracker receives: own inertial states, and what its radio received.

block of the group -> states of each car -> sums of its motion -> messages -> states elsewhere
"""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel, small_kernel
from tracking.ranging.compiled.motion import integrate_state, receive_motion
from tracking.ranging.compiled.overheard import RANGE, RECEIVED_MESSAGE

JOIN, STATE, LEAVE = 0, 3, 6


@kernel
def share_events(block, over, senders, received, headings, powered, out):
    """Write the events of every car's own tracker and empty `over`.

    Args:
        block: Events of the groups after the orientation stage, as in `MeasurementBlock`.
        over: Overheard.
        senders: SENDER, (env, car), updated.
        received: RECEIVED, (env, receiver, sender), updated.
        headings: Heading by the last state of every car, (env, car) [rad], written.
        powered: Mask of the trackers with power, (env, car); only its shape is used.
        out: Events of the cars, (env car, slot), written.
    """
    n_envs, n = powered.shape
    for row in range(n_envs * n):
        for k in range(out.used[row]):
            out.valid[row, k] = False
        out.used[row] = 0
    for e in range(n_envs):
        k = 0
        for m in range(over.used[e]):
            if over.kind[e, m] == RECEIVED_MESSAGE:
                k = take_states(block, senders, headings, out, e, n, k, over.t[e, m])
                r, s = over.receiver[e, m], over.i[e, m]
                receive_motion(senders[e, s], received[e, r, s], over.t[e, m], s, out, e * n + r)
            else:
                append_range(over, out, e, e * n + over.receiver[e, m], m)
        take_states(block, senders, headings, out, e, n, k, math.inf)
        over.used[e] = 0


@small_kernel
def take_states(block, senders, headings, out, e, n, k, until):
    """Process states of the group up to a time from column k on; return the next column."""
    t, kind, node, values, valid = block.t, block.kind, block.i, block.values, block.valid
    while k < t.shape[1]:
        if valid[e, k] and kind[e, k] == STATE:
            if t[e, k] > until:
                break
            car = node[e, k]
            integrate_state(senders[e, car], t[e, k], values, e, k)
            w, x, y, z = values[e, k, 0], values[e, k, 1], values[e, k, 2], values[e, k, 3]
            headings[e, car] = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
            copy_event(block, out, e, k, e * n + car)
        elif valid[e, k] and kind[e, k] in (JOIN, LEAVE):
            for car in range(n):
                copy_event(block, out, e, k, e * n + car)
        k += 1
    return k


@small_kernel
def copy_event(block, out, e, k, row):
    """Append the event in column k to the events of a car."""
    m = out.used[row]
    if m >= out.t.shape[1]:
        return
    out.t[row, m], out.kind[row, m] = block.t[e, k], block.kind[e, k]
    out.i[row, m], out.j[row, m] = block.i[e, k], block.j[e, k]
    out.antenna_i[row, m], out.antenna_j[row, m] = block.antenna_i[e, k], block.antenna_j[e, k]
    for column in range(out.values.shape[2]):
        out.values[row, m, column] = block.values[e, k, column]
    out.has_power[row, m], out.valid[row, m] = block.has_power[e, k], True
    out.used[row] = m + 1


@small_kernel
def append_range(over, out, e, row, m):
    """Append the range in slot m of `over` to the events of a car."""
    k = out.used[row]
    if k >= out.t.shape[1]:
        return
    out.t[row, k], out.kind[row, k] = over.t[e, m], RANGE
    i, j = over.i[e, m], over.j[e, m]
    out.i[row, k], out.j[row, k], out.antenna_i[row, k], out.antenna_j[row, k] = i, j, i, j
    for column in range(out.values.shape[2]):
        out.values[row, k, column] = over.values[e, m, column] if column < 3 else 0.0
    out.has_power[row, k], out.valid[row, k] = True, True
    out.used[row] = k + 1


@kernel
def note_own_ranges(own, view):
    """Store the last range of every car to each other one; `own` are its own events."""
    n = view.t_last_range.shape[1]
    for row in range(own.t.shape[0]):
        e, car = row // n, row % n
        for k in range(own.used[row]):
            i, j = own.i[row, k], own.j[row, k]
            if own.kind[row, k] != RANGE or (car != i and car != j):
                continue
            other = i + j - car
            if own.t[row, k] >= view.t_last_range[e, car, other]:
                view.t_last_range[e, car, other] = own.t[row, k]
                view.distance[e, car, other] = own.values[row, k, 0]
                view.gap[e, car, other] = own.values[row, k, 1] - own.values[row, k, 2]
