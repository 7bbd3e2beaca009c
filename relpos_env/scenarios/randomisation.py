"""Randomisation of episodes; by default nothing is random.

Values are uniform in their interval `(low, high)`. Factors are log-uniform, so that half and
double are equally likely, and multiply the value of the scenario.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from relpos_env.errors import EnvError

Interval = tuple[float, float]
SAME: Interval = (1.0, 1.0)
NONE: Interval = (0.0, 0.0)

_FACTORS = (0.01, 100.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Randomisation:
    """Intervals of the values that are sampled for every episode."""

    n_cars: tuple[int, int] | None = None
    """[-] Minimum and maximum number of cars at the start; None is the scenario's number."""

    obstacles: tuple[int, int] = (0, 0)
    """[-] Number of additional obstacles. Obstacles that would block cars are left out."""
    obstacle_size: Interval = (0.2, 0.6)
    """[m] Length of each side of additional obstacles."""
    movable_share: float = 0.0
    """[1] Share of additional obstacles that cars can push."""

    imu_noise: Interval = SAME
    """[1] Factor on the white noise of gyroscopes and accelerometers."""
    imu_bias: Interval = SAME
    """[1] Factor on the residual biases of gyroscopes and accelerometers, and on their drift."""
    imu_vibration: Interval = SAME
    """[1] Factor on the vibration of a driving car."""
    mag_disturbance: Interval = SAME
    """[1] Factor on the distortion of the magnetic field by the building."""
    mag_hard_iron: Interval = SAME
    """[1] Factor on the residual hard-iron offset."""
    odometer_scale: Interval = SAME
    """[1] Factor on the error of the wheel radius."""

    radio_loss: Interval = SAME
    """[1] Factor on the message loss rate in line of sight."""
    radio_loss_nlos: Interval = SAME
    """[1] Factor on the message loss rate in NLOS."""
    range_noise: Interval = SAME
    """[1] Factor on the LOS range errors: timestamp noise, and fast and slow multipath."""
    range_excess: Interval = SAME
    """[1] Factor on the largest NLOS bias of a range."""
    clock_offset: Interval = SAME
    """[1] Factor on the frequency offsets of the clocks."""
    antenna_delay: Interval = NONE
    """[m] Added to the std of the residual range bias of each antenna after calibration."""

    friction: Interval = SAME
    """[1] Factor on the friction of tyres, the same for all cars."""
    mass: Interval = SAME
    """[1] Factor on the mass of all cars."""

    mount_ahead: Interval = NONE
    """[m] Distance of each car's tracker forward of the centre of mass."""
    mount_aside: Interval = NONE
    """[m] Distance of each car's tracker left of the centre of mass."""
    mount_height: Interval = NONE
    """[m] Height of each car's antenna above `RadioSimParams.antenna_height`, unknown to the
    tracker."""

    leave_rate: Interval = NONE
    """[1/min] Rate at which cars leave the room. Two cars always stay."""
    absence: Interval = (5.0, 20.0)
    """[s] Time until a car joins again, either the same or another absent one."""
    power_off_rate: Interval = NONE
    """[1/min] Rate at which trackers lose power while their cars drive on."""
    power_off_time: Interval = (2.0, 10.0)
    """[s] Duration of a power loss."""

    def __post_init__(self) -> None:
        for name, low, high in self._intervals():
            least, most = _LIMITS.get(name, _FACTORS)
            if not least <= low <= high <= most:
                raise EnvError(
                    f"{name}: expected {least:g} <= low <= high <= {most:g}, got {low}, {high}"
                )
        if not 0.0 <= self.movable_share <= 1.0:
            raise EnvError(f"movable_share: expected 0 to 1, got {self.movable_share}")

    @property
    def has_life(self) -> bool:
        """True if cars leave and join."""
        return self.leave_rate[1] > 0.0

    def _intervals(self) -> list[tuple[str, float, float]]:
        """Return name, low and high of every interval."""
        values = ((f.name, getattr(self, f.name)) for f in fields(self))
        return [(name, *value) for name, value in values if isinstance(value, tuple)]


_LIMITS: dict[str, Interval] = {
    "n_cars": (2, 20),
    "obstacles": (0, 50),
    "obstacle_size": (0.05, 20.0),
    "antenna_delay": (0.0, 10.0),
    "mount_ahead": (-1.0, 1.0),
    "mount_aside": (-1.0, 1.0),
    "mount_height": (-1.0, 1.0),
    "leave_rate": (0.0, 60.0),
    "absence": (0.1, 3600.0),
    "power_off_rate": (0.0, 60.0),
    "power_off_time": (0.1, 3600.0),
}
