"""What can keep data from supporting a calibration."""

from tracking.errors import TrackingError


class CalibrationError(TrackingError):
    """Data that cannot support a calibration: says why, and what is needed."""
