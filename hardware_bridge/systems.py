"""On which systems what works; docs/explanation/safety.md has the table."""

from __future__ import annotations

import sys

from hardware_bridge.errors import BridgeError


def expect_linux(what: str) -> None:
    """Refuse another system in a sentence.

    Args:
        what: Needs Linux.

    Raises:
        BridgeError: This is none.
    """
    if sys.platform != "linux":
        raise BridgeError(f"{what} needs Linux, not {sys.platform}; see docs/explanation/safety.md")


def expect_posix(what: str) -> None:
    """Refuse Windows in a sentence.

    Args:
        what: Needs what POSIX systems have.

    Raises:
        BridgeError: This is Windows.
    """
    if sys.platform == "win32":
        raise BridgeError(f"{what} needs Linux or macOS; see docs/explanation/safety.md")
