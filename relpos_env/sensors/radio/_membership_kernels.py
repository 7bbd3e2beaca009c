"""Group membership by the radios' own protocol: JOIN and LEAVE events.

The initiator of a round decides on the members of the next (`tracking.ranging.members`), and a
listening host receives its table. A node in no table for `PATIENCE` has left; the delay keeps
the estimates of a node that is behind an obstacle for a few rounds.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel

INITIATOR = 1
"""Role of a session, see `tracking.ranging.compiled.turns`."""
JOIN, LEAVE = 0, 6
PATIENCE = 1.0
"""[s] Time without an entry in a table after which a node has left."""
LAST, IS_MEMBER = 0, 1
"""Columns of the membership state of a node: time of its last table [s]; 1 after its JOIN."""


@small_kernel
def note_members(air, members, t, events, e, k):
    """Append JOIN and LEAVE events of the group and return the index of the next event.

    Args:
        air: Air of all environments.
        members: Membership state of each node, (env, node, 2), updated.
        t: Current time [s].
        events: Events, written from index k on.
        e: Index of the environment.
        k: Index of the next event.
    """
    table = 0
    for n in range(members.shape[1]):
        if air.nodes[e, n].on and air.sessions[e, n].role == INITIATOR:
            table |= air.sessions[e, n].members
    if table == 0:
        return k  # no node leads
    for n in range(members.shape[1]):
        if k >= events.t.shape[1]:
            break
        was_member = members[e, n, IS_MEMBER] > 0.0
        if (table >> n) & 1:
            members[e, n, LAST] = t
            changes = not was_member
        else:
            changes = was_member and t - members[e, n, LAST] > PATIENCE
        if changes:
            members[e, n, IS_MEMBER] = 0.0 if was_member else 1.0
            write_member(events, e, k, t, LEAVE if was_member else JOIN, n)
            k += 1
    return k


@small_kernel
def write_member(events, e, k, t, kind, n):
    """Write an event of one node without values."""
    events.t[e, k], events.kind[e, k] = t, kind
    events.i[e, k], events.j[e, k] = n, n
    events.antenna_i[e, k], events.antenna_j[e, k] = 0, 0
    for column in range(events.values.shape[2]):
        events.values[e, k, column] = 0.0
    events.has_power[e, k], events.nlos[e, k], events.valid[e, k] = False, False, True
