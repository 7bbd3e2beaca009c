"""Why a policy is refused."""

from __future__ import annotations

from pathlib import Path

from agents.errors import UsageError


class PolicyError(UsageError):
    """A policy that cannot be used; the message is ``file: reason``."""

    def __init__(self, where: str | Path, reason: str) -> None:
        """Say which and why.

        Args:
            where: The file, or the name of the policy.
            reason: What was expected and what came.
        """
        # Names of files may hold anything; what is printed must not.
        shown = str(where).encode("unicode_escape", "replace").decode("ascii")
        super().__init__(f"{shown}: {reason}")
        self.where = str(where)
        self.reason = reason

    def __reduce__(self) -> tuple[type[PolicyError], tuple[str, str]]:
        """For other processes: made again from both arguments, not from the message."""
        return PolicyError, (self.where, self.reason)
