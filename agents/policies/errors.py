"""Errors of policies."""

from __future__ import annotations

from pathlib import Path

from agents.errors import UsageError


class PolicyError(UsageError):
    """A policy that cannot be used; the message is ``file: reason``."""

    def __init__(self, where: str | Path, reason: str) -> None:
        """Build the message.

        Args:
            where: File, or name of the policy.
            reason: Expected and actual value.
        """
        # File names may contain control characters, which must not be printed.
        shown = str(where).encode("unicode_escape", "replace").decode("ascii")
        super().__init__(f"{shown}: {reason}")
        self.where = str(where)
        self.reason = reason

    def __reduce__(self) -> tuple[type[PolicyError], tuple[str, str]]:
        """Support pickling: rebuild from both arguments, not from the message."""
        return PolicyError, (self.where, self.reason)
