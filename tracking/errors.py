"""What can go wrong in a way the user can mend.

A bad measurement is not an error: it is counted and skipped.
"""


class TrackingError(Exception):
    """Root of the package's errors; the message says what was expected and what came."""


class LogError(TrackingError):
    """A log folder that cannot be read: names the file and the row or field."""


class ConfigError(TrackingError):
    """A configuration that makes no sense: names the field and what is allowed."""


class WireError(TrackingError):
    """Bytes that are no ranging message: names the field."""
