"""Parameters of the paper's filter, and its options where the paper's text leaves a choice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tracking.errors import ConfigError
from tracking.params.checks import check_numbers

CHOICES = {
    "speed": ("norm", "rate"),
    "feedback": ("replace", "update", "none"),
    "alignment": ("procrustes", "none"),
    "scaling": ("root", "fourth-root"),
}
"""Values of each option, the default first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperParams:
    """Noise, gate and options of `paper-ekf` and `paper-ekf-mds`.

    Covariances are constant and diagonal, "determined empirically" in the paper. The defaults are
    chosen on simulated runs of cars and people, seeds 1000 to 1009 (docs/explanation/paper.md).
    """

    accel_std: float = 0.2
    """[m/s2] Noise n_a of a node's world acceleration: the root of the diagonal of Q_a, eq. (2)."""
    range_std: float = 0.02
    """[m] Noise of a range: the root of the first element of R."""
    speed_std: float = 10.0
    """[m/s] Noise of the low-passed range derivative: the root of the second element of R."""
    speed_tau: float = 0.1
    """[s] Time constant of the low-pass filter of the derivative."""
    gate_tau: float = 0.1
    """[s] Time constant of the running average that a range is compared with."""
    gate_floor: float = 0.35
    """[m] Accepted difference from the running average at zero relative speed."""
    gate_gain: float = 0.3
    """[s] Growth of the accepted difference with the last relative speed."""
    gate_reset: int = 8
    """[-] Number of ranges in a row outside the gate, the last of which restarts the average. The
    paper specifies no recovery from a wrong average."""
    k: int = 8
    """[-] Number of first measurements of a pair that initialise its filter."""
    mds_std: float = 0.1
    """[m] Noise of an MDS position, with `feedback="update"` only."""
    imu_timeout: float = 0.3
    """[s] Age of the last IMU sample beyond which the acceleration of a node counts as zero."""
    lost_after: float = 1.0
    """[s] Age of the last accepted range beyond which a pair is LOST."""
    node_timeout: float = 5.0
    """[s] Age of the last range beyond which a node has left and its filters are destroyed."""
    speed: Literal["norm", "rate"] = "norm"
    """Model of the speed measurement: ``|v|`` as in eq. (10), or ``x . v / |x|``, which is the
    derivative of the range."""
    feedback: Literal["replace", "update", "none"] = "replace"
    """Use of the MDS positions: they replace x_ij, are measurements of x_ij with noise `mds_std`,
    or are not used."""
    alignment: Literal["procrustes", "none"] = "procrustes"
    """Rotation and reflection of the MDS positions: those nearest to the filters' x_ij, or those of
    the eigenvectors, which are arbitrary. The paper specifies none."""
    scaling: Literal["root", "fourth-root"] = "root"
    """Scale of the MDS positions: ``E Lambda^(1/2)``, which reproduces the distances, or the root
    of the root as the paper's Lambda_3 is defined, which does not."""
    first_layout: tuple[tuple[float, float, float], ...] | None = None
    """[m] Positions of all nodes that the first MDS is aligned to. None keeps the rotation and
    reflection of the eigenvectors: the paper specifies no other."""

    def __post_init__(self) -> None:
        check_numbers(self)
        for name, values in CHOICES.items():
            if getattr(self, name) not in values:
                allowed = " or ".join(map(repr, values))
                raise ConfigError(f"{name}: expected {allowed}, got {getattr(self, name)!r}")
