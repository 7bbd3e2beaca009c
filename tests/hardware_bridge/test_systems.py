"""Other systems are refused with a one-line message."""

import pytest

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.links import Links
from hardware_bridge.systems import expect_linux, expect_posix


def test_systems_are_named(monkeypatch):
    expect_linux("this")
    monkeypatch.setattr("sys.platform", "darwin")
    expect_posix("this")
    with pytest.raises(
        BridgeError, match="^driving cars needs Linux, not darwin; see docs/explanation/safety"
    ):
        expect_linux("driving cars")
    monkeypatch.setattr("sys.platform", "win32")
    with pytest.raises(BridgeError, match="^listening to ports needs Linux or macOS"):
        Links([], lambda: 0)
