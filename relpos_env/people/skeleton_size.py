"""Lengths and widths of a person, as shares of the body height.

Lengths are those of Drillis and Contini [1] as drawn in [2], fig. 4.1. Joint centres lie inside
the shoulder and hip breadths given there. Radii of limbs are half the mean breadths, near
those of [3], for a body of 1.75 m; they grow with height.

References:
    [1] Drillis, Contini, Body segment parameters, report 1166-03, New York University 1966.
    [2] Winter, Biomechanics and motor control of human movement, 4th ed., Wiley 2009.
    [3] Gordon et al., 2012 anthropometric survey of U.S. Army personnel, NATICK/TR-15/007.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

STRETCH = 0.985
"""[-] Length of a standing leg relative to a straight one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SkeletonSize:
    """Lengths and radii of one person [m]."""

    height: float = 1.75

    @property
    def thigh(self) -> float:
        """Distance from hip to knee."""
        return 0.245 * self.height

    @property
    def shank(self) -> float:
        """Distance from knee to ankle."""
        return 0.246 * self.height

    @property
    def ankle(self) -> float:
        """Height of the ankle over the floor."""
        return 0.039 * self.height

    @property
    def foot(self) -> float:
        """Distance from the ankle to the ball of the foot, along the floor."""
        return 0.070 * self.height

    @property
    def toe_ahead(self) -> float:
        """Distance from under the pelvis to the ball of the foot of a standing person."""
        return self.foot - 0.02

    @property
    def hip(self) -> float:
        """Distance from the middle of the pelvis to a hip joint."""
        return 0.050 * self.height

    @property
    def trunk(self) -> float:
        """Distance from hips to shoulders."""
        return 0.288 * self.height

    @property
    def shoulder(self) -> float:
        """Distance from the middle to a shoulder joint."""
        return 0.112 * self.height

    @property
    def upper_arm(self) -> float:
        """Distance from shoulder to elbow."""
        return 0.186 * self.height

    @property
    def forearm(self) -> float:
        """Distance from elbow to wrist."""
        return 0.146 * self.height

    @property
    def head(self) -> float:
        """Distance from the shoulders to the top of the head."""
        return 0.182 * self.height

    def radius(self, limb: str) -> float:
        """Return the radius of a limb: trunk, head, thigh, shank, upper arm or forearm."""
        return self.height / 1.75 * RADII[limb]

    def standing_hip(self, stance: float) -> float:
        """Return the height of the hips of a standing person.

        Args:
            stance: Distance from the middle to the ball of each foot [m].
        """
        leg = STRETCH * (self.thigh + self.shank)
        behind = self.foot - self.toe_ahead
        return self.ankle + float(np.sqrt(leg**2 - (stance - self.hip) ** 2 - behind**2))


RADII = {
    "trunk": 0.15,
    "head": 0.10,
    "thigh": 0.08,
    "shank": 0.055,
    "upper arm": 0.05,
    "forearm": 0.04,
}
"""[m] Radii for a body of 1.75 m."""
