"""Checks of the operating system; docs/explanation/safety.md lists the features per system."""

from __future__ import annotations

import sys

from hardware_bridge.errors import BridgeError


def expect_linux(what: str) -> None:
    """Raise an error on any system but Linux.

    Args:
        what: The feature that needs Linux, named in the message.

    Raises:
        BridgeError: The system is not Linux.
    """
    if sys.platform != "linux":
        raise BridgeError(f"{what} needs Linux, not {sys.platform}; see docs/explanation/safety.md")


def expect_posix(what: str) -> None:
    """Raise an error on Windows.

    Args:
        what: The feature that needs a POSIX system, named in the message.

    Raises:
        BridgeError: The system is Windows.
    """
    if sys.platform == "win32":
        raise BridgeError(f"{what} needs Linux or macOS; see docs/explanation/safety.md")
