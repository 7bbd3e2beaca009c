"""What is rare and large: each is compiled by itself, when it is first needed.

`event_loop.run_events` returns the number of one of them and is called again when it is done. So
those that track a log compile what the log needs, and a range reaches little code.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tracking.filters.joint import workspace
from tracking.filters.joint.hypotheses.alignment_modes import monitor_modes
from tracking.filters.joint.hypotheses.bank import (
    add_mirror_image,
    challenge,
    drop_timed_out,
    remove_node,
)
from tracking.filters.joint.hypotheses.initialisation import join, start
from tracking.filters.joint.hypotheses.static_initialisation import spawn_rotation_hypotheses
from tracking.filters.joint.scalar_update import flush_all_updates
from tracking.filters.joint.state import one_env
from tracking.filters.joint.supervision.actions import reinitialise_node
from tracking.filters.joint.supervision.staleness import drop_stale
from tracking.filters.joint.surveyed_distance import apply_surveys
from tracking.filters.joint.workspace import ENV, EVENT, FLAG, NODE
from tracking.jit import Call, bind, kernel
from tracking.reference import by_reference


@kernel
def time_out(coefficients, layout, state, work, t):
    """Remove nodes without ranges for long."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    flush_all_updates(s)
    drop_timed_out(coefficients[0], s, layout, t)


@kernel
def spawn(coefficients, layout, state, work, t):
    """Follow all rotations and mirror images, as the first node moves."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    flush_all_updates(s)
    spawn_rotation_hypotheses(coefficients[0], s, layout, work)


@kernel
def stale(coefficients, layout, state, work, t):
    """Remove nodes that were silent and may be anywhere."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    flush_all_updates(s)
    drop_stale(coefficients[0], s, layout, t)


@kernel
def modes(coefficients, layout, state, work, t):
    """Move each hypothesis to its mode of the rotation."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    monitor_modes(coefficients[0], by_reference(one_env(state, cursor[ENV])), layout)


@kernel
def reflect(coefficients, layout, state, work, t):
    """Add the mirror image."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    add_mirror_image(coefficients[0], by_reference(one_env(state, cursor[ENV])))


@kernel
def challenge_alignment(coefficients, layout, state, work, t):
    """Follow all rotations and mirror images again."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    challenge(coefficients[0], by_reference(one_env(state, cursor[ENV])), layout)


@kernel
def reinitialise(coefficients, layout, state, work, t):
    """Look for another position of a node."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    cursor[FLAG] = reinitialise_node(coefficients[0], s, layout, cursor[NODE], cursor[FLAG] != 0, t)


@kernel
def start_group(coefficients, layout, state, work, t):
    """Start the group."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    c, s = coefficients[0], by_reference(one_env(state, cursor[ENV]))
    start(c, s, layout, t)
    for a in range(s.nodes.shape[0]):
        apply_surveys(c, s, layout, work, a, a)


@kernel
def join_group(coefficients, layout, state, work, t):
    """Let a node join."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    c, s, new = coefficients[0], by_reference(one_env(state, cursor[ENV])), cursor[NODE]
    flush_all_updates(s)
    join(c, s, layout, new, t)
    apply_surveys(c, s, layout, work, new, s.nodes.shape[0])


@kernel
def remove(coefficients, layout, state, work, t):
    """Remove a node that has left."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    flush_all_updates(s)
    remove_node(coefficients[0], s, layout, cursor[NODE])


RARE: dict[int, Callable[..., None]] = {
    workspace.TIME_OUT: time_out,
    workspace.SPAWN: spawn,
    workspace.STALE: stale,
    workspace.TIME_OUT_LATER: time_out,
    workspace.MODES_STEP: modes,
    workspace.REFLECT: reflect,
    workspace.CHALLENGE: challenge_alignment,
    workspace.REINITIALISE: reinitialise,
    workspace.START: start_group,
    workspace.JOIN: join_group,
    workspace.JOIN_OTHER: join_group,
    workspace.REMOVE: remove,
}


def run_to_end(run: Callable[[], int], arguments: tuple[Any, ...]) -> None:
    """Call `run_events` until all events are handled, and what it needs between.

    Args:
        run: `run_events` with its arguments.
        arguments: Its arguments.
    """
    coefficients, layout, state, work, events, *_ = arguments
    work.cursor[:] = 0
    while action := run():
        t = events[0][work.cursor[ENV], work.cursor[EVENT]]
        RARE[action](coefficients, layout, state, work, t)


def compile_all(arguments: tuple[Any, ...]) -> None:
    """Compile everything ahead, for those that cannot wait later."""
    for kernel_, given in rare_calls(arguments):
        bind(kernel_, *given)


def rare_calls(arguments: tuple[Any, ...]) -> list[Call]:
    """These kernels and their arguments."""
    coefficients, layout, state, work, *_ = arguments
    given = coefficients, layout, state, work, 0.0
    return [(action, given) for action in dict.fromkeys(RARE.values())]
