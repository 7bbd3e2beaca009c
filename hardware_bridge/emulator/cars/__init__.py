"""Emulated motor controllers: the counterparts of the drivers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hardware_bridge.drivers import driver_options
from hardware_bridge.emulator.cars.base import CarFirmware
from hardware_bridge.emulator.cars.pwm import PwmFirmware
from hardware_bridge.emulator.cars.relpos import RelposFirmware
from hardware_bridge.emulator.cars.vesc import VescFirmware

FIRMWARE: dict[str, Callable[[int, Any, bytes | None, int], CarFirmware]] = {
    "pwm": lambda node, options, key, boot: PwmFirmware(node, options),
    "vesc": lambda node, options, key, boot: VescFirmware(node, options),
    "relpos": RelposFirmware,
}
"""Name of a driver to the firmware of its controller, from node, options and key of the driver and
boot number of the car."""


def make_firmware(
    name: str, node: int, options: Mapping[str, object], key: bytes | None = None, boot: int = 1
) -> CarFirmware:
    """Return the firmware that matches a driver.

    Args:
        name: One of `FIRMWARE`.
        node: The node that the car carries.
        options: Options of the driver.
        key: Key of the driver, if it signs.
        boot: Differs from one start of the car to the next, for firmware that numbers messages.

    Raises:
        BridgeError: As in `hardware_bridge.drivers.make_driver`.
    """
    checked = driver_options(name, node, options, key)
    return FIRMWARE[name](node, checked, key, boot)
