"""User errors."""


class UsageError(Exception):
    """Invalid request of a user; the message names the option and its allowed values."""
