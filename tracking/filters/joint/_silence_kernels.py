"""Nodes that were not heard for a while, and may be anywhere by now.

A second without ranges or samples leaves a moving node a metre from where it is believed, two
seconds several. Ranges to a place that is as wrong as it is far bend too much for a filter that
takes them for straight: it comes out mirrored, or turned, and is sure of it. So such a node
joins anew as it is heard again, and a group of such nodes begins anew.
"""

from __future__ import annotations

from tracking.compiled import kernel

SILENCE = 0.5
"""[s] Who was heard since is where it was believed to be."""


@kernel
def has_faded(c, s, i, t):
    """True if node i was silent and its place is uncertain relative to every other.

    As uncertain as no pair may be that is ok, in the reported hypothesis, of which nothing waits
    and which was carried to t.
    """
    node, h = s.nodes[i], s.group[0].best
    if not node.present or node.static or t - node.t_heard <= SILENCE:
        return False
    for k in range(s.nodes.shape[0]):
        if k == i or not s.nodes[k].present:
            continue
        worst = 0.0
        for a in range(c.d):
            at, other = node.at_p + a, s.nodes[k].at_p + a
            worst = max(worst, s.P[h, at, at] + s.P[h, other, other] - 2.0 * s.P[h, at, other])
        if worst <= c.ok_var:
            return False
    return True
