"""Errors that the user can correct; damaged bytes raise none, they are counted and skipped."""


class BridgeError(Exception):
    """A port, configuration or recording is unusable; the message names it and a remedy."""
