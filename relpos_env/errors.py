"""What can go wrong in a way the user can mend."""


class EnvError(Exception):
    """Root of the package's errors; names the argument, what is allowed and what came."""
