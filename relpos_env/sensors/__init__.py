"""Simulated sensors and their error models; filters have parameters of their own."""

from relpos_env.sensors.imu import HUMAN_IMU, Imu, ImuSimParams
from relpos_env.sensors.magnetometer import Magnetometer, MagSimParams
from relpos_env.sensors.odometer import OdometerSimParams
from relpos_env.sensors.proximity import ProximitySimParams
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.sensors.radio.radio import Radio

__all__ = [
    "HUMAN_IMU",
    "Imu",
    "ImuSimParams",
    "MagSimParams",
    "Magnetometer",
    "OdometerSimParams",
    "ProximitySimParams",
    "Radio",
    "RadioSimParams",
]
