"""What can go wrong in a way the user can mend."""


class EnvError(Exception):
    """Root of the package's errors; names the argument, what is allowed and what came."""


class UnknownArgument(EnvError, TypeError):
    """An argument of no such name, as Python's own error for it, which other tools look for."""
