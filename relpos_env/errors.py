"""User errors of the package."""


class EnvError(Exception):
    """Base class of user errors; messages name the argument, the allowed and the given value."""


class UnknownArgument(EnvError, TypeError):
    """Unknown argument; also a `TypeError` as in Python itself, which other tools expect."""
