"""What a user of the command line can mend."""


class UsageError(Exception):
    """A request that makes no sense: names the option and what is allowed."""
