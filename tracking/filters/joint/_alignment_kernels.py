"""Questions that kernels ask of the alignment of a group (`alignment`)."""

from __future__ import annotations

from tracking.jit import small_kernel
from tracking.filters.joint.alignment import Alignment

# Plain numbers: kernels do not know enums.
NONE, STATIC, LINEAR, CHALLENGED, MODES, CANDIDATES, FILTERED = (a.value for a in Alignment)


@small_kernel
def is_linear(group):
    """True while the rotation is estimated by sensitivities, outside of the states."""
    return LINEAR <= group.alignment <= MODES


@small_kernel
def has_modes(group):
    """True while hypotheses are modes of one rotation, copied from one filter."""
    return MODES <= group.alignment <= CANDIDATES
