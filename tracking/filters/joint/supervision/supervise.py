"""Supervision of a group: node timeouts, pruning of hypotheses, faults."""

from __future__ import annotations

from tracking.filters.joint.ekf.gauge import heading_variance
from tracking.filters.joint.ekf.workspace import (
    CHALLENGE,
    FLAG,
    MODES_STEP,
    NODE,
    NOTHING,
    REFLECT,
    REINITIALISE,
    SPLIT,
    TIME_OUT_LATER,
)
from tracking.filters.joint.hypotheses.alignment import FILTERED, is_linear
from tracking.filters.joint.hypotheses.bank import (
    any_timed_out,
    flush_all_updates,
    needs_reflection,
    prune_bank,
)
from tracking.filters.joint.supervision.actions import begin_node_fault, follow_node_faults
from tracking.filters.joint.supervision.faults import (
    ALIGNMENT,
    DIVERGED,
    NONE,
    POSITION,
    find_fault,
    update_group_misfit,
)
from tracking.filters.joint.supervision.missing_ranges import is_silent
from tracking.kernels.jit import kernel, small_kernel


@kernel
def supervise(c, s, layout, work, t, done):
    """Supervise a group once a period: node timeouts, pruning and alignment, faults.

    Returns:
        Action that is due before supervision goes on, see `rare`.
    """
    flush_all_updates(s)
    if done < TIME_OUT_LATER and any_timed_out(c, s, t):
        return TIME_OUT_LATER
    if done < MODES_STEP and is_linear(s.group[0]):
        return MODES_STEP
    if done < REFLECT:
        prune_bank(c, s)
        update_heading_variance(c, s)
        if done < SPLIT and needs_split(c, s, t):
            return SPLIT
        if needs_reflection(c, s):
            return REFLECT
    is_helpless = done == REINITIALISE and work.cursor[FLAG] == 0
    if done < CHALLENGE or is_helpless:
        if not is_helpless:
            update_group_misfit(c, s, t - s.group[0].t_check)
        # If no other position fits better, the ranges are wrong.
        fault, node = find_fault(c, s, layout, t, is_helpless)
        if fault == ALIGNMENT:
            return CHALLENGE
        if fault in (POSITION, DIVERGED):
            work.cursor[NODE], work.cursor[FLAG] = node, fault == DIVERGED
            return REINITIALISE
        if fault != NONE:
            begin_node_fault(c, s, layout, node, fault, t)
    follow_node_faults(c, s, layout, t)
    s.group[0].t_check = t
    return NOTHING


@small_kernel
def needs_split(c, s, t):
    """True if the only hypothesis of a group that has moved has too uncertain a rotation.

    Never with a silent node: its position is uncertain, which says nothing about the rotation.
    Never in a smoother, which has one hypothesis only and keeps the rotation as it is.
    """
    group = s.group[0]
    if group.alignment != FILTERED or group.n_alive != 1 or c.n > c.n_own:
        return False
    for node in s.nodes:
        if is_silent(c, node, t):
            return False
    return group.heading_gauge_var > c.split_std**2


@kernel
def update_heading_variance(c, s):
    """Update the variance of the rotation of the best hypothesis, in the plane."""
    if c.d == 2:
        s.group[0].heading_gauge_var = heading_variance(c, s, s.group[0].best)
