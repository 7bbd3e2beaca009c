"""Labelled GOSPA: one error for positions, joins and leaves together.

The generalised optimal sub-pattern assignment metric [1] with exponent 2, alpha 2 and known
labels: a pair that is estimated and present costs its error, at most the cut-off c; one that is
missed (present, not estimated) or false (estimated, not present) costs ``c / sqrt(2)``:

    GOSPA^2 = sum min(error, c)^2 + c^2 / 2 (missed + false)

Known labels need no assignment; an error beyond c counts as one missed and one false pair, which
is the same c^2.

References:
    [1] Rahmathullah, Garcia-Fernandez, Svensson, Generalized optimal sub-pattern assignment
        metric, FUSION 2017.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.errors import ConfigError
from tracking.estimate import Status, TeamEstimate
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True)
class Gospa:
    """The metric over a run and its parts."""

    __repr__ = short_repr

    total: F64
    """GOSPA, (time) [m]."""
    localisation: F64
    """Squared position errors in the square of the metric, (time) [m2]."""
    missed: I64
    """Number of pairs that are present and not estimated, (time)."""
    false: I64
    """Number of pairs that are estimated and not present, (time)."""

    @property
    def rms(self) -> float:
        """Root mean square over the run [m]."""
        return float(np.sqrt(np.mean(self.total**2)))


def labelled_gospa(
    estimate: TeamEstimate, truth_ij_w: F64, is_there: Bool, *, cutoff: float = 1.0
) -> Gospa:
    """Score a run in which nodes join and leave.

    Args:
        estimate: Estimate of one run, arrays over (time, pair).
        truth_ij_w: True relative positions, (time, pair, 3) [m].
        is_there: True while both nodes are in the group, (time, pair).
        cutoff: c, the error that costs as much as a missed pair and a false one [m].

    Raises:
        ConfigError: The cut-off is not above 0.
    """
    if not cutoff > 0.0:
        raise ConfigError(f"cutoff: expected a length above 0, got {cutoff:g}")
    estimated = ~np.isin(estimate.status, (Status.ABSENT, Status.STARTING))
    both = estimated & is_there
    off = np.where(both[..., None], estimate.pos_ij_w - truth_ij_w, 0.0)
    error = np.linalg.norm(off[..., : estimate.constellation.dimensions], axis=-1)
    localisation = np.sum(np.minimum(error, cutoff) ** 2, axis=-1)
    missed = np.sum(is_there & ~estimated, axis=-1)
    false = np.sum(estimated & ~is_there, axis=-1)
    total = np.sqrt(localisation + 0.5 * cutoff**2 * (missed + false))
    return Gospa(total=total, localisation=localisation, missed=missed, false=false)
