"""Serial ports of this computer, permissions, and the port that a configuration refers to."""

from __future__ import annotations

import getpass
import os
import stat
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import PortSpec

BY_ID = Path("/dev/serial/by-id")


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialPortInfo:
    """A serial port as listed by the system; unknown fields are empty."""

    path: str
    by_id: str = ""
    """Path that is permanent for the adapter."""
    serial_number: str = ""
    """Serial number of the USB adapter: ``port = "serial:..."``."""
    maker: str = ""
    product: str = ""


Listing = Callable[[], Sequence[SerialPortInfo]]


def list_serial_ports() -> list[SerialPortInfo]:
    """Return all available serial ports, sorted by path.

    Raises:
        BridgeError: pyserial is not installed.
    """
    try:
        from serial.tools.list_ports import comports
    except ImportError as error:
        raise BridgeError(
            "serial ports need pyserial: pip install -e '.[hardware]' in its source folder"
        ) from error

    try:
        ports = comports()
    except Exception as error:  # the files of a port disappear while it is unplugged
        raise BridgeError(f"the serial ports cannot be listed: {error}; try again") from error
    names = _names_by_device()
    found = [
        SerialPortInfo(
            path=port.device,
            by_id=names.get(os.path.realpath(port.device), ""),
            serial_number=port.serial_number or "",
            maker=port.manufacturer or "",
            product=port.product or "",
        )
        for port in ports
    ]
    return sorted(found, key=lambda port: port.path)


def _names_by_device() -> dict[str, str]:
    try:
        links = sorted(BY_ID.iterdir())
    except OSError:
        return {}
    return {os.path.realpath(link): str(link) for link in links}


def device_path(spec: PortSpec, listing: Listing = list_serial_ports) -> str:
    """Return the device of `spec`; a serial number is looked up at every call.

    Raises:
        BridgeError: No adapter or several have the number: there is no guess.
    """
    kind, _, number = spec.port.partition(":")
    if kind != "serial":
        return spec.port
    ports = listing()
    having = [port for port in ports if number and port.serial_number == number]
    if len(having) == 1:
        return having[0].path
    if having:
        paths = ", ".join(port.by_id or port.path for port in having)
        raise BridgeError(
            f"{spec.name}: {len(having)} ports have the serial number {number}: {paths}; "
            "give the path of one of them as port"
        )
    known = ", ".join(sorted({p.serial_number for p in ports if p.serial_number})) or "none"
    raise BridgeError(
        f"{spec.name}: no adapter with serial number {number} is plugged in; there are: {known}"
    )


def permission_remedy(path: str) -> str:
    """Return the remedy for a missing permission to open a port."""
    import grp

    device = os.path.realpath(path)
    try:
        mode = os.stat(device)
        group = grp.getgrgid(mode.st_gid).gr_name
    except (OSError, KeyError):
        return "run `ls -l` on it to see who may"
    kernel = os.path.basename(device).rstrip("0123456789")
    if not kernel:
        return "it is another user's pseudo terminal: run both programs as the same user"
    if group == "root" or not mode.st_mode & stat.S_IRGRP or not mode.st_mode & stat.S_IWGRP:
        rule = f'KERNEL=="{kernel}*", GROUP="dialout", MODE="0660"'
        return f"add the udev rule {rule} in /etc/udev/rules.d/50-serial.rules and plug it in again"
    user = getpass.getuser()
    if user in grp.getgrgid(mode.st_gid).gr_mem:
        return f"you were added to the group {group}: log out and in again"
    return f"run `sudo usermod -aG {group} {user}`, then log out and in again"
