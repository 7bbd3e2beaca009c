"""Car model: a dynamic bicycle with servo, motor, tyres that can slide, roll and pitch.

Equations and closed forms in docs/reference/vehicle.md. The centre of mass is the origin of the
car and the middle of its collision box; the positions of the axles follow from their loads.

References:
    [1] F1TENTH Gym, parameters of a 1:10 car: friction 1.0489, cornering stiffness 4.718 and
        5.4562 per friction and load, axles 0.159 m and 0.171 m off the centre of mass,
        +-0.4189 rad at 3.2 rad/s. https://github.com/f1tenth/f1tenth_gym
    [2] Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992: ch. 4 rolling resistance, ch. 5
        ride, ch. 6 cornering.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from relpos_env.errors import EnvError
from relpos_env.timing import DT
from relpos_env.world._car_kernels import N_PAST
from tracking.geometry import GRAVITY

MAX_STEERING_DELAY = (N_PAST - 1) * DT
"""[s] Largest steering delay."""
CAR = np.dtype(
    (np.record, [
        (name, np.float64)
        for name in (
            "mass", "mass_inv", "inertia", "inertia_inv", "front", "rear", "front_load",
            "rear_load", "friction", "front_stiffness", "rear_stiffness", "front_drive", "rolling",
            "rolling_share", "max_speed", "max_accel", "max_brake", "speed_gain", "motor_keep",
            "max_steering", "steering_rate", "delay_steps",
            "roll_per_force", "roll_stiffness", "roll_damping", "roll_slack",
            "pitch_per_force", "pitch_stiffness", "pitch_damping", "pitch_slack",
        )
    ])
)  # fmt: skip
"""Record type of a car for the kernels; see `car_record`."""

_POSITIVE = (
    "mass", "length", "width", "wheelbase", "friction", "front_cornering", "rear_cornering",
    "max_speed", "max_accel", "max_brake", "speed_gain", "motor_lag", "max_steering",
    "steering_rate", "roll_frequency", "pitch_frequency",
)  # fmt: skip
_NOT_NEGATIVE = (
    "rolling_resistance", "steering_delay", "roll_compliance", "pitch_compliance", "sway_damping",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class CarParams:
    """Parameters of a 1:10 RC car."""

    mass: float = 2.5
    """[kg] Mass of the car."""
    length: float = 0.42
    """[m] Length of the collision box."""
    width: float = 0.20
    """[m] Width of the collision box."""
    wheelbase: float = 0.30
    """[m] Distance between the axles."""
    front_share: float = 0.52
    """[-] Share of the weight on the front axle, l_r / wheelbase [1]. A larger one understeers."""
    friction: float = 1.05
    """[-] Friction of the tyres on an indoor floor [1]."""
    front_cornering: float = 4.95
    """[1/rad] Cornering stiffness of the front axle per load on it [1]. A lower one understeers."""
    rear_cornering: float = 5.72
    """[1/rad] Cornering stiffness of the rear axle per load on it [1]."""
    front_drive: float = 0.5
    """[-] Share of the motor and brake force at the front axle; 0.5 is four-wheel drive."""
    rolling_resistance: float = 0.02
    """[-] Force per load: 0.015 on hard floor [2], more for soft treads; the motor adds it."""
    max_speed: float = 3.0
    """[m/s] Largest speed, forwards and backwards."""
    max_accel: float = 2.5
    """[m/s2] Largest acceleration of the motor, rolling resistance included."""
    max_brake: float = 2.5
    """[m/s2] Largest deceleration by the motor as a brake."""
    speed_gain: float = 8.0
    """[1/s] Gain of the motor controller, acceleration per speed error."""
    motor_lag: float = 0.05
    """[s] Time constant of the lag of the motor's acceleration; assumed."""
    max_steering: float = 0.42
    """[rad] Largest steering angle [1]."""
    steering_rate: float = 3.2
    """[rad/s] Largest rate of the servo [1]."""
    steering_delay: float = 0.02
    """[s] Delay of the servo; rounded to steps, at most `MAX_STEERING_DELAY`."""
    roll_compliance: float = 0.005
    """[rad/(m/s2)] Roll per lateral acceleration: 2.8 deg/g, a stiff car."""
    pitch_compliance: float = 0.003
    """[rad/(m/s2)] Dive per braking deceleration: 1.7 deg/g; assumed."""
    roll_frequency: float = 5.0
    """[Hz] Undamped natural frequency of roll: a car's 1.5 Hz [2] times sqrt(10) for the scale."""
    pitch_frequency: float = 5.0
    """[Hz] Undamped natural frequency of pitch: a car's 1.5 Hz [2] times sqrt(10) for the scale."""
    sway_damping: float = 0.4
    """[-] Damping ratio of roll and pitch; 0.2 to 0.4 in cars [2]."""

    def __post_init__(self) -> None:
        for name in _POSITIVE:
            if not 0.0 < getattr(self, name) < np.inf:
                raise EnvError(f"{name}: expected a positive number, got {getattr(self, name)!r}")
        for name in _NOT_NEGATIVE:
            if not 0.0 <= getattr(self, name) < np.inf:
                raise EnvError(f"{name}: expected 0 or more, got {getattr(self, name)!r}")
        if not 0.0 < self.front_share < 1.0:
            raise EnvError(f"front_share: expected within (0, 1), got {self.front_share!r}")
        if not 0.0 <= self.front_drive <= 1.0:
            raise EnvError(f"front_drive: expected 0 to 1, got {self.front_drive!r}")
        if self.max_steering >= 0.5 * pi:
            raise EnvError(f"max_steering: expected below pi/2, got {self.max_steering!r}")
        if self.steering_delay > MAX_STEERING_DELAY:
            raise EnvError(
                f"steering_delay: expected at most {MAX_STEERING_DELAY:g} s, "
                f"got {self.steering_delay!r}"
            )

    @property
    def inertia(self) -> float:
        """Moment of inertia of a box about the vertical [kg m2]."""
        return self.mass * (self.length**2 + self.width**2) / 12.0

    @property
    def front_axle(self) -> float:
        """Distance of the front axle from the centre of mass [m]."""
        return (1.0 - self.front_share) * self.wheelbase

    @property
    def rear_axle(self) -> float:
        """Distance of the rear axle from the centre of mass [m]."""
        return self.front_share * self.wheelbase

    @property
    def understeer(self) -> float:
        """Gradient K of the yaw rate gain v / (wheelbase + K v^2) far below the grip [s2 rad]."""
        return (1.0 / self.front_cornering - 1.0 / self.rear_cornering) / GRAVITY


def car_record(params: CarParams, dt: float = DT) -> NDArray[np.void]:
    """Return the record of a car for steps of dt [s]: dtype `CAR`, shape ()."""
    p, weight = params, params.mass * GRAVITY
    record = np.zeros((), CAR)
    for name in (
        "mass", "inertia", "friction", "front_drive", "max_speed", "max_accel", "max_brake",
        "speed_gain", "max_steering", "steering_rate",
    ):  # fmt: skip
        record[name] = getattr(p, name)
    record["mass_inv"], record["inertia_inv"] = 1.0 / p.mass, 1.0 / p.inertia
    record["front"], record["rear"] = p.front_axle, p.rear_axle
    record["front_load"] = front = weight * p.front_share
    record["rear_load"] = rear = weight - front
    record["front_stiffness"] = p.front_cornering * front
    record["rear_stiffness"] = p.rear_cornering * rear
    record["rolling"] = p.rolling_resistance * GRAVITY
    record["rolling_share"] = p.rolling_resistance
    record["motor_keep"] = np.exp(-dt / p.motor_lag)
    record["delay_steps"] = min(round(p.steering_delay / dt), N_PAST - 1)
    for name in ("roll", "pitch"):
        omega = 2.0 * pi * getattr(p, f"{name}_frequency")
        damping = 2.0 * p.sway_damping * omega
        record[f"{name}_per_force"] = getattr(p, f"{name}_compliance") / p.mass
        record[f"{name}_stiffness"] = omega**2
        record[f"{name}_damping"] = damping
        record[f"{name}_slack"] = 1.0 / (1.0 + 0.5 * dt * (damping + 0.5 * dt * omega**2))
    return record
