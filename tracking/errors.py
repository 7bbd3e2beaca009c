"""Errors that the user can correct.

A bad measurement is not an error: it is counted and skipped.
"""


class TrackingError(Exception):
    """Base class of the package's errors; the message names the expected and the given value."""


class LogError(TrackingError):
    """A log folder cannot be read; the message names the file and the row or field."""


class ConfigError(TrackingError):
    """A configuration is invalid; the message names the field and the allowed values."""


class WireError(TrackingError):
    """Bytes are not a ranging message; the message names the field."""
