"""Rare, large operations: each is compiled by itself, when it is first needed.

`event_loop.run_events` returns the number of an action and is called again when its kernels are
done. So a log compiles only the kernels that it needs, and a range reaches little code; those for
groups in space alone are not compiled for groups in the plane.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tracking.filters.joint.ekf import workspace
from tracking.filters.joint.ekf.workspace import ENV, EVENT, FLAG, NODE
from tracking.filters.joint.hypotheses.alignment_modes import challenge_alignment, monitor_modes
from tracking.filters.joint.hypotheses.alignment_sensitivity import start_alignments
from tracking.filters.joint.hypotheses.bank import (
    add_mirror_image,
    challenge,
    drop_timed_out,
    remove_node,
    split_rotation,
)
from tracking.filters.joint.hypotheses.initialisation import join, start
from tracking.filters.joint.hypotheses.static_initialisation import spawn_rotation_hypotheses
from tracking.filters.joint.state import one_env
from tracking.filters.joint.supervision.actions import reinitialise_node
from tracking.filters.joint.supervision.missing_ranges import drop_stale
from tracking.filters.joint.updates.surveyed_distance import apply_surveys
from tracking.kernels.addresses import by_reference
from tracking.kernels.jit import Call, bind, kernel, kind_of


@kernel
def time_out(coefficients, layout, state, work, t):
    """Remove nodes that have timed out."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    drop_timed_out(coefficients[0], s, layout, t)


@kernel
def spawn(coefficients, layout, state, work, t):
    """Spawn all rotations and mirror images, as the first node moves."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    spawn_rotation_hypotheses(coefficients[0], s, layout, work)


@kernel
def align(coefficients, layout, state, work, t):
    """Start the alignment of a group in space that has just started, or moved."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    start_alignments(coefficients[0], by_reference(one_env(state, cursor[ENV])), layout)


@kernel
def stale(coefficients, layout, state, work, t):
    """Remove silent nodes whose distances are uncertain."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    drop_stale(coefficients[0], s, layout, t)


@kernel
def modes(coefficients, layout, state, work, t):
    """Rotate the frame of each hypothesis to its mode."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    monitor_modes(coefficients[0], by_reference(one_env(state, cursor[ENV])), layout)


@kernel
def split(coefficients, layout, state, work, t):
    """Spawn all rotations and mirror images of a group whose rotation is too uncertain."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    split_rotation(coefficients[0], s, layout, work)


@kernel
def reflect(coefficients, layout, state, work, t):
    """Add the mirror image of the best hypothesis."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    add_mirror_image(coefficients[0], by_reference(one_env(state, cursor[ENV])))


@kernel
def challenge_in_plane(coefficients, layout, state, work, t):
    """Spawn all rotations and mirror images again."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    challenge(coefficients[0], by_reference(one_env(state, cursor[ENV])), layout)


@kernel
def challenge_in_space(coefficients, layout, state, work, t):
    """Search for a likelier rotation or mirror image."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    challenge_alignment(coefficients[0], by_reference(one_env(state, cursor[ENV])), layout)


@kernel
def reinitialise(coefficients, layout, state, work, t):
    """Search for another position of a node."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    cursor[FLAG] = reinitialise_node(coefficients[0], s, layout, cursor[NODE], cursor[FLAG] != 0, t)


@kernel
def start_group(coefficients, layout, state, work, t):
    """Start the group."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    start(coefficients[0], by_reference(one_env(state, cursor[ENV])), layout, t)


@kernel
def survey_group(coefficients, layout, state, work, t):
    """Correct a group that has just started with its surveyed distances."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    c, s = coefficients[0], by_reference(one_env(state, cursor[ENV]))
    for a in range(s.nodes.shape[0]):
        apply_surveys(c, s, layout, work, a, a)


@kernel
def join_group(coefficients, layout, state, work, t):
    """Add a node to the group."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    c, s, new = coefficients[0], by_reference(one_env(state, cursor[ENV])), cursor[NODE]
    join(c, s, layout, new, t)


@kernel
def survey_newcomer(coefficients, layout, state, work, t):
    """Correct a node that has just joined with its surveyed distances."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    c, s, new = coefficients[0], by_reference(one_env(state, cursor[ENV])), cursor[NODE]
    apply_surveys(c, s, layout, work, new, s.nodes.shape[0])


@kernel
def remove(coefficients, layout, state, work, t):
    """Remove a node that has left."""
    cursor, layout, work = work.cursor, by_reference(layout), by_reference(work)
    s = by_reference(one_env(state, cursor[ENV]))
    remove_node(coefficients[0], s, layout, cursor[NODE])


_compiled: set[Any] = set()
"""Groups, in the plane or in space, and kinds of arguments whose kernels are all compiled."""
Rare = Callable[..., None]
ACTIONS: dict[int, tuple[Rare, ...]] = {
    workspace.TIME_OUT: (time_out,),
    workspace.SPAWN: (spawn,),
    workspace.STALE: (stale,),
    workspace.TIME_OUT_LATER: (time_out,),
    workspace.SPLIT: (split,),
    workspace.REFLECT: (reflect,),
    workspace.CHALLENGE: (challenge_in_plane,),
    workspace.REINITIALISE: (reinitialise,),
    workspace.START: (start_group, survey_group),
    workspace.JOIN: (join_group, survey_newcomer),
    workspace.JOIN_OTHER: (join_group, survey_newcomer),
    workspace.REMOVE: (remove,),
}
"""Kernels of each action, called one after the other."""
WITH_RANGES = (survey_group, survey_newcomer)
"""Kernels that share most of their code with that of ranges."""
ACTIONS_IN_SPACE: dict[int, tuple[Rare, ...]] = {
    **{action: done for action, done in ACTIONS.items() if action != workspace.SPLIT},
    workspace.SPAWN: (spawn, align),
    workspace.MODES_STEP: (modes,),
    workspace.CHALLENGE: (challenge_in_space,),
    workspace.START: (start_group, align, survey_group),
}
"""Kernels of each action with linear alignment (`alignment_sensitivity.has_linear_alignment`)."""


def actions_of(coefficients: Any, state: Any) -> dict[int, tuple[Rare, ...]]:
    """Return the actions that a group can need."""
    n_nodes, has_slopes = state.nodes.shape[1], state.sensitivity.shape[2] > 0
    return ACTIONS_IN_SPACE if has_slopes and n_nodes > coefficients[0]["d"] else ACTIONS


def run_to_end(run: Callable[[], int], arguments: tuple[Any, ...]) -> None:
    """Call `run_events` until all events are handled, and the rare kernels that it requests.

    Args:
        run: `run_events` with its arguments.
        arguments: Arguments of `run_events`.
    """
    coefficients, layout, state, work, events, *_ = arguments
    work.cursor[:] = 0
    while action := run():
        t = events[0][work.cursor[ENV], work.cursor[EVENT]]
        for rare in actions_of(coefficients, state)[action]:
            rare(coefficients, layout, state, work, t)


def compile_all(arguments: tuple[Any, ...]) -> None:
    """Compile all rare kernels in advance, for callers with deadlines."""
    coefficients, _, state, *_ = arguments
    known = actions_of(coefficients, state) is ACTIONS, kind_of(arguments)
    if known in _compiled:
        return
    for calls in rare_calls(arguments):
        for rare, given in calls:
            bind(rare, *given)
    if known[1] is not None:
        _compiled.add(known)


def rare_calls(arguments: tuple[Any, ...]) -> list[list[Call]]:
    """Return the rare kernels with their arguments, in groups that share little code.

    The groups: kernels that share code with ranges, the others of all actions, those in space.
    """
    coefficients, layout, state, work, *_ = arguments
    given = coefficients, layout, state, work, 0.0
    needed, common = _kernels(actions_of(coefficients, state)), _kernels(ACTIONS)
    rest = [rare for rare in common if rare not in WITH_RANGES]
    in_space = [rare for rare in needed if rare not in common]
    groups = list(WITH_RANGES), rest, in_space
    return [[(rare, given) for rare in group] for group in groups if group]


def _kernels(actions: dict[int, tuple[Rare, ...]]) -> list[Rare]:
    return list(dict.fromkeys(rare for one in actions.values() for rare in one))
