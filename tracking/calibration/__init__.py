"""Estimation of sensor errors from recordings, and correction of measurements."""

from tracking.calibration.calibration import (
    Calibration,
    NodeCalibration,
    RangeCalibration,
    merge,
)
from tracking.calibration.distances import RangeTable, range_table
from tracking.calibration.errors import CalibrationError
from tracking.calibration.file import calibration_toml, read_calibration
from tracking.calibration.imu import ImuResult, calibrate_imu
from tracking.calibration.magnetometer import MagResult, calibrate_magnetometer
from tracking.calibration.uwb import UwbParams, UwbResult, calibrate_uwb

__all__ = [
    "Calibration",
    "CalibrationError",
    "ImuResult",
    "MagResult",
    "NodeCalibration",
    "RangeCalibration",
    "RangeTable",
    "UwbParams",
    "UwbResult",
    "calibrate_imu",
    "calibrate_magnetometer",
    "calibrate_uwb",
    "calibration_toml",
    "merge",
    "range_table",
    "read_calibration",
]
