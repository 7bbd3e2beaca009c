"""Alignment of a group: knowledge of its rotation and reflection, as a state machine.

Ranges alone give the layout of a group up to a rotation and a reflection. `Alignment` says which
filters represent the possible rotations; `TRANSITIONS` lists every transition between two states
and its cause. In the plane a bank of rotations is filtered from the first motion on; in space, with
more than three nodes, one filter with linear sensitivities comes first (`alignment_sensitivity`),
then a Gaussian sum of its modes (`alignment_modes`).
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from tracking.kernels.jit import small_kernel
from tracking.records import Records


class Alignment(IntEnum):
    """Alignment of a group, `GROUP.alignment`."""

    NONE = 0
    """The group is not initialised."""
    STATIC = 1
    """No node has moved: one rotation represents all."""
    LINEAR = 2
    """One filter with sensitivities to the rotation represents all rotations."""
    CHALLENGED = 3
    """As `LINEAR`, but a rotation is reported until another one is clearly likelier."""
    MODES = 4
    """Each hypothesis is a mode of the rotation, with sensitivities to rotations near it."""
    CANDIDATES = 5
    """Each hypothesis is a mode whose rotation is a part of its covariance."""
    FILTERED = 6
    """The rotation is a part of the covariance of each hypothesis: of the bank, or the last one."""


TRANSITIONS: dict[Alignment, dict[Alignment, str]] = {
    Alignment.NONE: {
        Alignment.STATIC: "the first ranges of a group at rest",
        Alignment.LINEAR: "the first ranges of a group in motion, in space",
        Alignment.FILTERED: "the first ranges of a group in motion, in the plane or of three nodes",
    },
    Alignment.STATIC: {
        Alignment.LINEAR: "a node moves, in space",
        Alignment.FILTERED: "a node moves, in the plane or of three nodes",
        Alignment.NONE: "fewer than two nodes are left",
    },
    Alignment.LINEAR: {
        Alignment.MODES: "each mode is known to 0.7 rad",
        Alignment.NONE: "fewer than two nodes are left",
    },
    Alignment.CHALLENGED: {
        Alignment.MODES: "another rotation is clearly likelier",
        Alignment.FILTERED: "no other rotation is likelier",
        Alignment.LINEAR: "the group has just started on wheels in motion",
        Alignment.NONE: "fewer than two nodes are left",
    },
    Alignment.MODES: {
        Alignment.CANDIDATES: "each mode is known to 0.15 rad",
        Alignment.LINEAR: "the group has just started on wheels in motion",
        Alignment.NONE: "fewer than two nodes are left",
    },
    Alignment.CANDIDATES: {
        Alignment.FILTERED: "one hypothesis is left",
        Alignment.CHALLENGED: "the last hypothesis fits badly for seconds",
        Alignment.NONE: "fewer than two nodes are left",
    },
    Alignment.FILTERED: {
        Alignment.CHALLENGED: "the last hypothesis fits badly for seconds, in space",
        Alignment.NONE: "fewer than two nodes are left",
    },
}
"""State to its following states, with the cause of each."""

ALLOWED = np.array([[b == a or b in TRANSITIONS[a] for b in Alignment] for a in Alignment])
"""Allowed transitions for kernels, (from, to)."""

# Plain numbers: kernels do not know enums.
NONE, STATIC, LINEAR, CHALLENGED, MODES, CANDIDATES, FILTERED = (a.value for a in Alignment)


@small_kernel
def set_alignment(group, to):
    """Set the alignment of a group; count transitions that `TRANSITIONS` does not have."""
    if not ALLOWED[group.alignment, to]:
        group.n_illegal_steps += 1
    group.alignment = to


@small_kernel
def is_linear(group):
    """True while the rotation is estimated by sensitivities, outside of the states."""
    return LINEAR <= group.alignment <= MODES


@small_kernel
def has_modes(group):
    """True while hypotheses are modes of one rotation, copied from one filter."""
    return MODES <= group.alignment <= CANDIDATES


def freeze_alignment(group: Records) -> None:
    """Make the best hypothesis the only one, in a copy of groups that is not reported.

    Args:
        group: GROUP, (env, 1), updated.
    """
    group["best"], group["n_alive"] = 0, np.minimum(group["n_alive"], 1)
    group["alignment"] = np.where(group["alignment"] >= LINEAR, FILTERED, group["alignment"])
