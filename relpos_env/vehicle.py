"""The car: a bicycle with steered front wheels, a speed controller and tyres that can slide.

Each axle resists sideways motion with whatever force stops it within a step, up to the grip
of its tyres, mu m g / 2 (Coulomb friction as a clamped impulse [1]). Below the limit the car
follows the kinematic bicycle, turning radius L / tan(steering); beyond it the axle slides.

References:
    [1] Catto, Iterative dynamics with temporal coherence, GDC 2005.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class CarParams:
    """A 1:10 RC car."""

    mass: float = 2.5
    """[kg]"""
    length: float = 0.42
    """[m] Of the body that collides."""
    width: float = 0.20
    """[m]"""
    wheelbase: float = 0.30
    """[m]"""
    friction: float = 1.05
    """[-] Tyre on indoor floor."""
    max_speed: float = 3.0
    """[m/s]"""
    max_accel: float = 2.5
    """[m/s2] Motor and brake."""
    speed_gain: float = 8.0
    """[1/s] The motor controller asks for so much acceleration per speed error."""
    max_steering: float = 0.42
    """[rad]"""
    steering_rate: float = 3.2
    """[rad/s] Of the servo."""

    @property
    def inertia(self) -> float:
        """Moment of inertia of a box about the vertical [kg m2]."""
        return self.mass * (self.length**2 + self.width**2) / 12.0
