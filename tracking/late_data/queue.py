"""Queue of measurements, one per environment, kept in handling order.

Events lie in slots that never move; `order` lists the slots: queued ones in order, then free
ones, the last freed first, since they are still in the cache. A new event is put at the end and
moved forward past those that follow it, which is one comparison for one that arrives in order.
Only values of devices are kept: those of the tracker's own orientations come after the horizon.
"""

from __future__ import annotations

from tracking.kernels.jit import kernel, small_kernel
from tracking.measurements import N_MEASURED, N_VALUES

TIME, KIND, NODE_I, NODE_J, ANTENNA_I, ANTENNA_J, VALUES, HAS_POWER = 0, 1, 2, 3, 4, 5, 6, 14
"""Columns of a slot: the fields of `MeasurementBlock` [s, -], in the order of comparison."""
N_COLUMNS = 16
"""Columns of a slot, two cache lines; the last one is unused."""


@small_kernel
def is_before(s, e, a, b):
    """Return whether the event in slot a is handled before that in b: time, kind, nodes.

    Ties are broken by antennas and values, so the order of arrival has no effect.
    """
    for column in range(TIME, HAS_POWER):
        if s.slots[e, a, column] != s.slots[e, b, column]:
            return s.slots[e, a, column] < s.slots[e, b, column]
    return False


@small_kernel
def is_same(s, e, a, b):
    """Return whether two events are one measurement."""
    same = True
    for column in range(TIME, HAS_POWER):
        same = same and s.slots[e, a, column] == s.slots[e, b, column]
    return same


@small_kernel
def put_in_slot(s, e, slot, block, k):
    """Copy the event in column k of a block into a slot."""
    t, kind, i, j, antenna_i, antenna_j, values, has_power, _ = block
    slots = s.slots
    slots[e, slot, TIME], slots[e, slot, KIND] = t[e, k], kind[e, k]
    slots[e, slot, NODE_I], slots[e, slot, NODE_J] = i[e, k], j[e, k]
    slots[e, slot, ANTENNA_I], slots[e, slot, ANTENNA_J] = antenna_i[e, k], antenna_j[e, k]
    for v in range(N_MEASURED):
        slots[e, slot, VALUES + v] = values[e, k, v]
    slots[e, slot, HAS_POWER] = has_power[e, k]


@small_kernel
def enqueue(s, e, slot):
    """Move the event in the first free slot to its position; False for a duplicate."""
    end = s.n_waiting[e]
    place = end
    while place > 0 and is_before(s, e, slot, s.order[e, place - 1]):
        place -= 1
    if place > 0 and is_same(s, e, slot, s.order[e, place - 1]):
        return False
    for at in range(end, place, -1):
        s.order[e, at] = s.order[e, at - 1]
    s.order[e, place] = slot
    s.n_waiting[e] += 1
    return True


@small_kernel
def turn_round(order, e, start, stop):
    """Reverse a part of an order."""
    for k in range((stop - start) // 2):
        a, b = start + k, stop - 1 - k
        order[e, a], order[e, b] = order[e, b], order[e, a]


@small_kernel
def free_first(s, e, n):
    """Free the first n slots, and put them first among the free ones."""
    waiting = s.n_waiting[e]
    turn_round(s.order, e, 0, n)
    turn_round(s.order, e, n, waiting)
    turn_round(s.order, e, 0, waiting)
    s.n_waiting[e] = waiting - n


@kernel
def take_in(s, block):
    """Queue the events of a block in order.

    Late events and duplicates are dropped and counted.

    Args:
        s: HorizonState, updated.
        block: Events, (env, event, ...), the arrays of a `MeasurementBlock` in their order.

    Returns:
        Number of events left out for lack of slots.
    """
    t, valid = block[0], block[8]
    n_refused = 0
    for e in range(t.shape[0]):
        for k in range(t.shape[1]):
            if not valid[e, k]:
                continue
            if not t[e, k] > s.released[e]:
                s.n_late[e] += 1
                continue
            if s.n_waiting[e] == s.order.shape[1]:
                n_refused += 1
                continue
            slot = s.order[e, s.n_waiting[e]]
            put_in_slot(s, e, slot, block, k)
            if not enqueue(s, e, slot):
                s.n_doubled[e] += 1
    return n_refused


@kernel
def count_due(s, until):
    """Return the largest number of events of an environment up to a time, (env) [s]."""
    most = 0
    for e in range(until.shape[0]):
        low, high = 0, s.n_waiting[e]
        while low < high:
            middle = (low + high) // 2
            if s.slots[e, s.order[e, middle], TIME] <= until[e]:
                low = middle + 1
            else:
                high = middle
        most = max(most, low)
    return most


@kernel
def hand_on(s, until, remove, out):
    """Write the queued events up to a time.

    Args:
        s: HorizonState, updated.
        until: Times, (env) [s].
        remove: True to remove them from the queue.
        out: Events, written, (env, event, ...), at least `count_due` columns; the rest becomes
            padding.
    """
    t, kind, i, j, antenna_i, antenna_j, values, has_power, valid = out
    slots = s.slots
    for e in range(t.shape[0]):
        n = 0
        while n < s.n_waiting[e]:
            slot = s.order[e, n]
            if slots[e, slot, TIME] > until[e]:
                break
            t[e, n], kind[e, n] = slots[e, slot, TIME], int(slots[e, slot, KIND])
            i[e, n], j[e, n] = int(slots[e, slot, NODE_I]), int(slots[e, slot, NODE_J])
            antenna_i[e, n] = int(slots[e, slot, ANTENNA_I])
            antenna_j[e, n] = int(slots[e, slot, ANTENNA_J])
            for v in range(N_MEASURED):
                values[e, n, v] = slots[e, slot, VALUES + v]
            for v in range(N_MEASURED, N_VALUES):
                values[e, n, v] = 0.0
            has_power[e, n], valid[e, n] = slots[e, slot, HAS_POWER] > 0.0, True
            n += 1
        for k in range(n, t.shape[1]):
            valid[e, k] = False
        if remove:
            free_first(s, e, n)
            s.released[e] = max(s.released[e], until[e])


@kernel
def sum_turns(s, kind, dt, out):
    """Integrate the yaw rate of every node about its own vertical over the queued samples.

    Args:
        s: HorizonState.
        kind: Kind of inertial samples.
        dt: Sample interval, (node) [s].
        out: Rotations, (env, node) [rad], written.
    """
    for e in range(out.shape[0]):
        for n in range(out.shape[1]):
            out[e, n] = 0.0
        for k in range(s.n_waiting[e]):
            slot = s.order[e, k]
            if s.slots[e, slot, KIND] == kind:
                i = int(s.slots[e, slot, NODE_I])
                out[e, i] += s.slots[e, slot, VALUES + 2] * dt[i]
