"""What is wrong in a way the user can mend; a damaged byte is none: it is counted and skipped."""


class BridgeError(Exception):
    """A port, a configuration or a recording that cannot be used: names it and what to do."""
