"""Error of insufficient calibration data."""

from tracking.errors import TrackingError


class CalibrationError(TrackingError):
    """Data do not support a calibration; the message gives the reason and the requirement."""
