"""What the pair filters believe: every number with its unit, its effect and its source."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class GateParams:
    """The outlier gate: a range against the running average of the past ones.

    A range passes when it differs from the average by less than
    ``floor + speed_gain * |vel_ij| * lag``, where lag is how old the average is.
    """

    tau: float = 0.1
    """[s] Time constant of the running average. Longer is steadier and lags more."""
    floor: float = 0.35
    """[m] What is allowed at rest: about four standard deviations of a range in sight."""
    speed_gain: float = 1.5
    """[-] How much of the motion since the average is allowed for."""
    max_rejected: int = 8
    """[-] So many rejected in a row that agree with each other are believed after all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MdsParams:
    """The refinement over the group."""

    period: float = 0.012
    """[s] Shortest time between two refinements: one ranging round of three nodes."""
    std: float = 0.05
    """[m] Standard deviation with which a refined position corrects the filters. 0 replaces
    the position outright, as the text of the paper has it."""
    min_spread: float = 0.15
    """[m] Layouts flatter than this are not refined: their mirror image cannot be told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StartParams:
    """Starting a group, or a node that joins it."""

    k: int = 8
    """[-] Ranges per pair whose mean starts the shape, the paper's first k measurements."""
    window: float = 4.0
    """[s] Longest stretch of motion used to find rotation and mirror image."""
    min_window: float = 1.5
    """[s] Shortest stretch tried."""
    retry: float = 0.25
    """[s] Time between two tries."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairEkfParams:
    """One extended Kalman filter per pair."""

    accel_psd: float = 0.2
    """[m/s2/sqrt(Hz)] Noise of one node's world acceleration: sensor noise, vibration and the
    slow error of a wrong tilt. Larger forgets dead reckoning sooner."""
    unaided_accel_psd: float = 0.7
    """[m/s2/sqrt(Hz)] The same for a moving node whose IMU is not heard."""
    orientation_std: float = 0.05
    """[rad] Error of one axis of a node's orientation; VQF states none."""
    range_std: float = 0.10
    """[m] Standard deviation of a range, 5 to 10 cm in real buildings."""
    survey_std: float = 0.02
    """[m] Standard deviation of a surveyed distance."""
    speed_model: Literal["range-rate", "speed-norm", "none"] = "range-rate"
    """What the derivative of the range is compared with: its true model, the rate of the
    distance, or the norm of the velocity as the paper writes."""
    speed_std: float = 0.5
    """[m/s] Standard deviation of the low-passed derivative."""
    speed_tau: float = 0.15
    """[s] Time constant of that low pass."""
    lost_after: float = 1.0
    """[s] A pair without an accepted range for so long is lost."""
    leave_after: float = 5.0
    """[s] A node not heard for so long has left; its filters are destroyed."""
    gate: GateParams = field(default_factory=GateParams)
    mds: MdsParams = field(default_factory=MdsParams)
    start: StartParams = field(default_factory=StartParams)
