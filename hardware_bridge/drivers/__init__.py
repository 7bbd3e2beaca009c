"""Car drivers: commands to bytes of motor controllers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from hardware_bridge.drivers.base import CarDriver
from hardware_bridge.drivers.options import read_options
from hardware_bridge.drivers.pwm import PwmDriver, PwmOptions
from hardware_bridge.drivers.relpos import RelposDriver, RelposOptions
from hardware_bridge.drivers.vesc import VescDriver, VescOptions
from hardware_bridge.errors import BridgeError

Build: TypeAlias = Callable[[int, Any, bytes | None, int, Callable[[], int]], CarDriver]
"""Node, options, key, boot number and clock [us] to a driver."""


@dataclass(frozen=True, slots=True)
class DriverEntry:
    """Registry entry of a driver."""

    build: Build
    options: type
    """Frozen dataclass of its options; fields without a default are required."""
    baud: int
    """[1/s] Default baud rate of the port."""
    takes_key: bool = False
    """True if its frames are signed."""


DRIVERS: dict[str, DriverEntry] = {
    "pwm": DriverEntry(lambda n, options, k, b, t: PwmDriver(options), PwmOptions, PwmDriver.baud),
    "vesc": DriverEntry(
        lambda n, options, k, b, t: VescDriver(options), VescOptions, VescDriver.baud
    ),
    "relpos": DriverEntry(RelposDriver, RelposOptions, RelposDriver.baud, takes_key=True),
}
"""Registry of drivers by name."""


def driver_entry(name: str, node: int) -> DriverEntry:
    """Return the registry entry of a driver.

    Raises:
        BridgeError: Unknown name; ``cars.<node>.driver`` is named.
    """
    if name not in DRIVERS:
        known = ", ".join(DRIVERS)
        raise BridgeError(f"cars.{node}.driver: expected one of {known}, got {name!r}")
    return DRIVERS[name]


def driver_options(name: str, node: int, options: Mapping[str, object], key: bytes | None) -> Any:
    """Return the checked options of a driver, without building it.

    Raises:
        BridgeError: As in `make_driver`.
    """
    entry = driver_entry(name, node)
    if key is not None and not entry.takes_key:
        raise BridgeError(f"cars.{node}.key: the driver {name} signs nothing, leave the key out")
    return read_options(entry.options, options, f"cars.{node}.options")


def make_driver(
    name: str,
    node: int,
    options: Mapping[str, object],
    key: bytes | None,
    boot: int,
    now_us: Callable[[], int],
) -> CarDriver:
    """Return a driver built from its configuration.

    Args:
        name: One of `DRIVERS`.
        node: Node that the car carries.
        options: Fields of the driver's options.
        key: 16 bytes that sign commands, for drivers that sign.
        boot: Differs from one start of this program to the next, for drivers that number commands.
        now_us: Clock [us] for drivers that stamp commands.

    Raises:
        BridgeError: Unknown driver or option, wrong type or range; the field is named.
    """
    checked = driver_options(name, node, options, key)
    return driver_entry(name, node).build(node, checked, key, boot, now_us)
