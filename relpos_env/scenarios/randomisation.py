"""What is drawn again for every episode. Nothing is, unless said.

An interval `(low, high)` is drawn from uniformly; a factor log-uniformly, so that half and
double are as likely, and multiplies what the scenario says.
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
    """What is drawn for an episode, each from an interval of its own."""

    n_cars: tuple[int, int] | None = None
    """[-] Fewest and most cars at the start; None is the scenario's number."""

    obstacles: tuple[int, int] = (0, 0)
    """[-] Number of further obstacles. Those that would leave cars no way are left out."""
    obstacle_size: Interval = (0.2, 0.6)
    """[m] Each side of them."""
    movable_share: float = 0.0
    """[1] Share of them that cars can push."""

    imu_noise: Interval = SAME
    """[1] Factor on the white noise of gyroscopes and accelerometers."""
    imu_bias: Interval = SAME
    """[1] Factor on what calibration left of their biases, and on how these drift."""
    imu_vibration: Interval = SAME
    """[1] Factor on what a driving car shakes."""
    mag_disturbance: Interval = SAME
    """[1] Factor on how the building bends the magnetic field."""
    mag_hard_iron: Interval = SAME
    """[1] Factor on the offset that calibration left."""
    odometer_scale: Interval = SAME
    """[1] Factor on the error of the wheel radius."""

    radio_loss: Interval = SAME
    """[1] Factor on the share of messages lost in sight."""
    radio_loss_nlos: Interval = SAME
    """[1] Factor on the share of messages lost behind an obstacle."""
    range_noise: Interval = SAME
    """[1] Factor on the errors of ranges in sight: stamps and multipath, fast and slow."""
    range_excess: Interval = SAME
    """[1] Factor on the largest excess of a range behind an obstacle."""
    clock_offset: Interval = SAME
    """[1] Factor on how differently the clocks run."""
    antenna_delay: Interval = NONE
    """[m] Added to the standard deviation of what each antenna adds to its ranges, which
    calibration should have taken away."""

    friction: Interval = SAME
    """[1] Factor on the grip of tyres, the same for all cars."""
    mass: Interval = SAME
    """[1] Factor on the mass of all cars."""

    mount_ahead: Interval = NONE
    """[m] How far the tracker of each car is ahead of its centre of mass."""
    mount_aside: Interval = NONE
    """[m] How far it is left of it."""
    mount_height: Interval = NONE
    """[m] How much higher its antenna is than `RadioSimParams.antenna_height`; the tracker is not
    told."""

    leave_rate: Interval = NONE
    """[1/min] How often one of the cars is taken out of the room. Two always stay."""
    absence: Interval = (5.0, 20.0)
    """[s] Until it comes back, or another one that is not in the room comes in its place."""
    power_off_rate: Interval = NONE
    """[1/min] How often the tracker of one of the cars loses power while the car drives on."""
    power_off_time: Interval = (2.0, 10.0)
    """[s] Until it has power again."""

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
        """Whether cars leave and join."""
        return self.leave_rate[1] > 0.0

    def _intervals(self) -> list[tuple[str, float, float]]:
        """Name, low and high of every interval."""
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
