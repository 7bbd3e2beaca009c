"""Configurations of drivers: errors name the path of the wrong option."""

from dataclasses import fields, is_dataclass

import pytest

from hardware_bridge.drivers import DRIVERS, make_driver
from hardware_bridge.drivers.vesc import VescOptions
from hardware_bridge.emulator.cars import make_firmware
from hardware_bridge.errors import BridgeError


def make(name, options, key=None):
    return make_driver(name, 1, options, key, 0, lambda: 0)


@pytest.mark.parametrize("name", sorted(DRIVERS))
def test_options_are_frozen_and_by_name(name):
    options = DRIVERS[name].options
    assert is_dataclass(options)
    assert options.__dataclass_params__.frozen
    assert all(f.kw_only for f in fields(options))


def test_options_arrive():
    driver = make("vesc", {"speed_to_erpm": 3000, "telemetry": False})
    assert driver.options == VescOptions(speed_to_erpm=3000.0, telemetry=False)
    driver = make("pwm", {"forward": [[1, 1600], [2.0, 1700.0]]})
    assert driver.options.forward == ((1.0, 1600), (2.0, 1700))
    assert [type(x) for x in driver.options.forward[1]] == [float, int]


@pytest.mark.parametrize(("name", "options", "said"), [
    ("tank", {}, r"cars\.1\.driver: expected one of .*vesc.*, got 'tank'"),
    ("vesc", {"erpm": 1.0}, r"cars\.1\.options\.erpm: expected one of speed_to_erpm, "),
    ("vesc", {"speed_to_erpm": "4614"},
     r"cars\.1\.options\.speed_to_erpm: expected a number, got '4614'"),
    ("vesc", {"speed_to_erpm": True}, r"speed_to_erpm: expected a number, got True"),
    ("vesc", {"speed_to_erpm": float("nan")}, r"speed_to_erpm: expected a finite number, got nan"),
    ("vesc", {"max_speed": float("inf")}, r"max_speed: expected a finite number, got inf"),
    ("vesc", {"speed_to_erpm": 0}, r"cars\.1\.options\.speed_to_erpm: expected a number that is "),
    ("vesc", {"servo_max": 3.0}, r"cars\.1\.options\.servo_max: expected 0 to 1, got 3\.0"),
    ("vesc", {"telemetry": 1}, r"cars\.1\.options\.telemetry: expected true or false, got 1"),
    ("pwm", {"steering_centre": 1500.5}, r"steering_centre: expected a whole number, got 1500\.5"),
    ("pwm", {"forward": 3.0}, r"cars\.1\.options\.forward: expected a list, got 3\.0"),
    ("pwm", {"forward": [[1.0, 1600, 3], [2.0, 1700]]}, r"forward: expected lists of 2, got "),
    ("pwm", {"forward": [["a", 1600], [2.0, 1700]]}, r"forward: expected a number, got "),
    ("pwm", {"forward": [[1.0, 1600]]}, r"forward: expected at least two points, got "),
])  # fmt: skip
def test_what_is_wrong_is_named(name, options, said):
    with pytest.raises(BridgeError, match=said):
        make(name, options)
    with pytest.raises(BridgeError, match=said):
        make_firmware(name, 1, options)


@pytest.mark.parametrize("name", sorted(DRIVERS))
def test_keys_go_where_they_are_used(name):
    if not DRIVERS[name].takes_key:
        with pytest.raises(BridgeError, match=r"cars\.1\.key: "):
            make(name, {}, bytes(16))
