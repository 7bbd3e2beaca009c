"""PWM boards: lines of pulses, tables of the throttle, and an emulated board."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hardware_bridge.drivers.pwm import PwmDriver, PwmOptions, pulse_of, speed_of
from hardware_bridge.emulator.cars.pwm import PwmFirmware
from hardware_bridge.errors import BridgeError

patient = settings(suppress_health_check=[HealthCheck.too_slow])

OPTIONS = PwmOptions(
    steering_span=-400, forward=((0.5, 1560), (1.0, 1600), (3.0, 1700)),
    reverse=((0.6, 1430), (2.0, 1300)),
)  # fmt: skip


def test_lines_as_the_board_takes_them():
    driver = PwmDriver(OPTIONS)
    assert driver.neutral() == b"1500, 1500\r"
    assert driver.opening() == b"\r1500, 1500\r"
    assert driver.drive(1.0, 0.21) == b"1300, 1600\r"
    assert driver.drive(2.0, -0.42) == b"1900, 1650\r"
    assert driver.drive(-2.0, 0.0) == b"1500, 1300\r"
    assert driver.drive(9.0, 9.0) == b"1100, 1700\r"
    assert driver.ask() == b""


@pytest.mark.parametrize("speed", [0.0, 0.3, -0.5])
def test_dead_zone_stands(speed):
    assert PwmDriver(OPTIONS).drive(speed, 0.0) == b"1500, 1500\r"


def test_without_a_table_it_never_drives_backwards():
    assert PwmDriver(PwmOptions()).drive(-3.0, 0.0) == b"1500, 1500\r"
    (reading,) = PwmFirmware(1, PwmOptions()).feed(b"1500, 1300\r")
    assert reading.speed == 0.0


def test_speed_controller_that_is_wired_backwards():
    options = PwmOptions(forward=((0.5, 1440), (3.0, 1200)), reverse=((0.5, 1560), (1.0, 1600)))
    driver, firmware = PwmDriver(options), PwmFirmware(1, options)
    for speed in (0.5, 1.75, 3.0, -0.5, -1.0):
        (reading,) = firmware.feed(driver.drive(speed, 0.0))
        assert reading.speed == pytest.approx(speed, abs=0.006)


@patient
@given(speed=st.floats(0.5, 3.0))
def test_table_and_back(speed):
    points, centre = OPTIONS.forward, OPTIONS.throttle_centre
    assert speed_of(pulse_of(speed, points, centre), points, centre) == pytest.approx(
        speed, abs=0.011
    )


@patient
@given(a=st.floats(0.0, 5.0), b=st.floats(0.0, 5.0))
def test_faster_is_further_from_the_centre(a, b):
    slow, fast = sorted((a, b))
    assert pulse_of(slow, OPTIONS.forward, 1500) <= pulse_of(fast, OPTIONS.forward, 1500) <= 1700
    assert pulse_of(slow, OPTIONS.reverse, 1500) >= pulse_of(fast, OPTIONS.reverse, 1500) >= 1300


@pytest.mark.parametrize("line", [
    b"1500,1500,1500\r", b"150, 1500\r", b"1500, 2001\r", b"0999, 1500\r", b"-500, 1500\r",
    b"hello\r", b"1500 1500\r", b"15e0, 1500\r", b" " * 65 + b"1500, 1500\r", b"9" * 5000 + b"\r",
])  # fmt: skip
def test_lines_that_are_refused(line):
    for parts in ([line], [bytes((b,)) for b in line]):
        firmware = PwmFirmware(1, OPTIONS)
        assert [r for part in parts for r in firmware.feed(part)] == []
        assert firmware.counts.damaged == 1
        assert len(firmware.feed(b"1500, 1500\r\n1500, 1600\r")) == 2


def test_the_board_talks_of_its_remote_control():
    driver, firmware = PwmDriver(OPTIONS), PwmFirmware(1, OPTIONS)
    said = firmware.encode([])
    assert said == b"1500, 1500\r\n"
    assert driver.telemetry.feed(said) == []
    assert (driver.telemetry.counts.skipped, driver.telemetry.waiting) == (1, 0)


@pytest.mark.parametrize("wrong", [
    {"steering_centre": 900}, {"steering_span": 0}, {"steering_span": 600}, {"max_steering": 0.0},
    {"throttle_centre": 2000}, {"forward": ((0.5, 1560),)}, {"forward": ()},
    {"forward": ((0.0, 1560), (1.0, 1600))}, {"forward": ((1.0, 1560), (0.5, 1600))},
    {"forward": ((0.5, 1600), (1.0, 1560))}, {"forward": ((0.5, 1560), (1.0, 2100))},
    {"forward": ((0.5, 1560), (1.0, 1400))}, {"forward": ((0.5, 1560), (99.0, 1600))},
    {"reverse": ((0.5, 1440),)}, {"reverse": ((0.5, 1560), (1.0, 1600))},
])  # fmt: skip
def test_options_that_cannot_be(wrong):
    (name,) = wrong
    with pytest.raises(BridgeError, match=rf"^{name}: expected .*, got "):
        PwmOptions(**wrong)
