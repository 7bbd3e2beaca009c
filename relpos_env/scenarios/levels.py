"""Curriculum levels: randomisation of a scenario in increasing strength.

The noise spans that of real devices of one type at level 1, and that of cheap, badly calibrated
devices at level 4. Each level includes the randomisation of the levels below.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.scenarios.randomisation import Randomisation

_EXACT = Randomisation()
_NOISE = Randomisation(
    imu_noise=(0.7, 1.5),
    imu_bias=(0.5, 1.5),
    imu_vibration=(0.7, 1.5),
    mag_disturbance=(0.5, 1.5),
    mag_hard_iron=(0.5, 1.5),
    odometer_scale=(0.5, 1.5),
    range_noise=(0.8, 1.3),
    clock_offset=(0.5, 1.5),
)
_ROOMS = replace(
    _NOISE,
    obstacles=(0, 3),
    movable_share=0.25,
    range_excess=(0.7, 1.5),
    radio_loss_nlos=(0.5, 2.0),
    friction=(0.8, 1.1),
    mass=(0.85, 1.2),
)
_LIFE = replace(
    _ROOMS,
    n_cars=(3, 6),
    radio_loss=(0.5, 5.0),
    leave_rate=(0.0, 2.0),
    power_off_rate=(0.0, 2.0),
)
_HARD = replace(
    _LIFE,
    n_cars=(2, 8),
    obstacles=(1, 6),
    obstacle_size=(0.2, 0.8),
    movable_share=0.4,
    imu_noise=(0.5, 3.0),
    imu_bias=(0.5, 3.0),
    imu_vibration=(0.5, 2.0),
    mag_disturbance=(0.5, 3.0),
    mag_hard_iron=(0.5, 3.0),
    odometer_scale=(0.5, 3.0),
    radio_loss=(0.5, 20.0),
    radio_loss_nlos=(0.5, 4.0),
    range_noise=(0.7, 2.0),
    range_excess=(0.5, 2.5),
    clock_offset=(0.5, 2.0),
    antenna_delay=(0.0, 0.15),
    mount_ahead=(-0.15, 0.2),
    mount_aside=(-0.05, 0.05),
    friction=(0.5, 1.2),
    mass=(0.7, 1.5),
    leave_rate=(0.0, 5.0),
    power_off_rate=(0.0, 5.0),
)

LEVELS: tuple[Randomisation, ...] = (_EXACT, _NOISE, _ROOMS, _LIFE, _HARD)
"""Cumulative levels: none; noise; obstacles, friction and mass; cars that leave and join; much
wider ranges and calibration errors."""


NAMES = {"easy": 1, "medium": 2, "hard": 3, "expert": 4}
"""Levels by name."""


def level_number(value: object) -> int:
    """Return the number of a level that is given by its number or name.

    Raises:
        EnvError: There is no such level.
    """
    if isinstance(value, str) and value in NAMES:
        return NAMES[value]
    is_bool = isinstance(value, bool)
    if isinstance(value, int | np.integer) and not is_bool and 0 <= value < len(LEVELS):
        return int(value)
    most, names = len(LEVELS) - 1, ", ".join(NAMES)
    raise EnvError(f"level: expected 0 to {most} or one of {names}, got {value!r}")


def level(value: object) -> Randomisation:
    """Return the randomisation of a level; arguments and errors as of `level_number`."""
    return LEVELS[level_number(value)]
