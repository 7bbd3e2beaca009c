"""Identification of the configured device, and the permission to open it."""

import errno
import os

import pytest
import serial

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.failures import number_of, reason_of
from hardware_bridge.links.port_list import SerialPortInfo, device_path, permission_remedy
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.links.serial_port import SerialPort

PORTS = [
    SerialPortInfo(path="/dev/ttyUSB0", serial_number="FT1", maker="FTDI"),
    SerialPortInfo(path="/dev/ttyUSB1", serial_number="FT2", by_id="/dev/serial/by-id/x-if00"),
    SerialPortInfo(path="/dev/ttyUSB2", serial_number="FT2", by_id="/dev/serial/by-id/x-if01"),
    SerialPortInfo(path="/dev/ttyS0"),
]


def path_of(port):
    return device_path(PortSpec(name="links.a", port=port), lambda: PORTS)


def test_a_serial_number_is_looked_up_and_never_guessed():
    assert path_of("serial:FT1") == "/dev/ttyUSB0"
    assert path_of("/dev/ttyUSB1") == "/dev/ttyUSB1"
    with pytest.raises(BridgeError, match=r"links\.a: 2 ports .*by-id/x-if00, .*by-id/x-if01"):
        path_of("serial:FT2")
    for none in ("serial:FT", "serial:ft1", "serial:"):
        with pytest.raises(BridgeError, match="there are: FT1, FT2$"):
            path_of(none)


def test_the_number_is_looked_up_anew_at_each_opening(tmp_path):
    master, slave = os.openpty()
    now = [SerialPortInfo(path=os.ttyname(slave), serial_number="N")]
    spec = PortSpec(name="links.a", port="serial:N")
    port = SerialPort(spec, lambda: now)
    assert port.path == os.ttyname(slave)
    port.close()
    port.close()
    now.clear()
    with pytest.raises(BridgeError, match="no adapter with serial number N"):
        SerialPort(spec, lambda: now)
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.EACCES, "no permission to open .*: (run|add|you were)"),
        (errno.EBUSY, "in use by another program"),
        (errno.ENODEV, "no port"),
        (errno.EIO, "cannot open"),
    ],
)
def test_why_a_port_does_not_open(monkeypatch, tmp_path, number, said):
    def refuse(*_, **__):
        raise serial.SerialException(number, f"could not open port: {os.strerror(number)}")

    monkeypatch.setattr(serial, "Serial", refuse)
    with pytest.raises(BridgeError, match=rf"^links\.a: .*{said}") as caught:
        SerialPort(PortSpec(name="links.a", port=str(tmp_path)))
    assert "\n" not in str(caught.value)


def test_the_remedy_names_the_group_or_a_rule(tmp_path, monkeypatch):
    import grp

    device = tmp_path / "ttyUSB7"
    device.touch()
    group = grp.struct_group(("dialout", "x", 20, ["ann"]))
    monkeypatch.setattr(grp, "getgrgid", lambda _: group)
    monkeypatch.setenv("LOGNAME", "bob")
    device.chmod(0o660)
    assert "sudo usermod -aG dialout bob" in permission_remedy(str(device))
    monkeypatch.setenv("LOGNAME", "ann")
    assert "log out and in again" in permission_remedy(str(device))
    device.chmod(0o600)
    assert 'KERNEL=="ttyUSB*", GROUP="dialout"' in permission_remedy(str(device))
    terminal = tmp_path / "7"
    terminal.touch()
    assert "as the same user" in permission_remedy(str(terminal))
    assert "ls -l" in permission_remedy(str(tmp_path / "none"))


def test_every_failure_has_words():
    import termios

    assert "unplugged" in reason_of(termios.error(errno.EIO, "Input/output error"))
    assert number_of(serial.SerialException("read failed")) is None
    assert reason_of(serial.PortNotOpenError())
    assert reason_of(KeyError()) == "KeyError"
    assert "\n" not in reason_of(RuntimeError("two\nlines"))


def test_the_line_is_raw_and_modem_lines_stay_up():
    import termios

    master, slave = os.openpty()
    port = SerialPort(PortSpec(name="links.a", port=os.ttyname(slave), baud=921600))
    _, oflag, cflag, lflag, ispeed, ospeed, cc = termios.tcgetattr(port.fileno())
    assert (ispeed, ospeed) == (termios.B921600, termios.B921600)
    assert cflag & termios.CS8
    assert not cflag & (termios.HUPCL | termios.PARENB | termios.CSTOPB | termios.CRTSCTS)
    assert not oflag & termios.OPOST
    assert not lflag & (termios.ICANON | termios.ECHO)
    assert cc[termios.VMIN] == 1
    port.close()
    os.close(master)
    os.close(slave)
