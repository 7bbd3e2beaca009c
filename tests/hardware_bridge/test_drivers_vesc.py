"""The VESC: frames of its protocol, its answers, and an emulated one."""

import struct
from binascii import crc_hqx

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hardware_bridge.counts import Counts
from hardware_bridge.drivers.vesc import (
    VescDriver,
    VescOptions,
    set_current_brake,
    set_rpm,
    set_servo,
)
from hardware_bridge.drivers.vesc_frames import LONGEST, MOST_PAYLOAD, FrameReader, frame
from hardware_bridge.drivers.vesc_values import VescValues, read_values, write_values
from hardware_bridge.emulator.cars.vesc import VescFirmware
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import UNNAMED, MotionReading, StatusReading

patient = settings(suppress_health_check=[HealthCheck.too_slow])

GOLDEN = {
    "02 01 04 40 84 03": frame(b"\x04"),
    "02 01 1e f3 ff 03": frame(b"\x1e"),
    "02 05 05 00 00 27 10 ae 17 03": frame(struct.pack(">Bi", 5, 10_000)),
    "02 05 07 00 00 13 88 21 74 03": set_current_brake(5000),
    "02 05 08 00 00 0b b8 f8 04 03": set_rpm(3000),
    "02 03 0c 01 f4 e9 cb 03": set_servo(500),
}
STRAIGHT = VescOptions(servo_centre=0.5, speed_to_erpm=3000.0)


def feed_all(reader, parts):
    return [payload for part in parts for payload in reader.feed(part)]


def single(data):
    return [bytes((b,)) for b in data]


@pytest.mark.parametrize("golden", GOLDEN)
def test_golden_frames(golden):
    data = bytes.fromhex(golden)
    assert GOLDEN[golden] == data
    for parts in ([data], single(data)):
        assert feed_all(FrameReader(Counts()), parts) == [data[2:-3]]


def test_golden_commands():
    driver = VescDriver(STRAIGHT)
    brake, rpm, servo = list(GOLDEN)[3:]
    assert driver.ask() == bytes.fromhex(next(iter(GOLDEN)))
    assert driver.neutral() == bytes.fromhex(brake)
    assert driver.drive(1.0, 0.0) == bytes.fromhex(servo + rpm)
    assert driver.drive(0.0, 0.0) == bytes.fromhex(servo + brake)


def test_crc_is_xmodem():
    """Compare with the check value of the CRC catalogue."""
    assert crc_hqx(b"123456789", 0) == 0x31C3


def test_never_keeps_the_motor_alive_without_a_command():
    driver = VescDriver(VescOptions())
    said = driver.opening() + driver.drive(1.0, 0.1) + driver.ask() + driver.neutral()
    commands = {payload[0] for payload in FrameReader(Counts()).feed(said)}
    assert commands == {12, 8, 4, 7}


@patient
@given(payloads=st.lists(st.binary(min_size=1, max_size=MOST_PAYLOAD), max_size=5), data=st.data())
def test_frames_of_all_lengths(payloads, data):
    sent = b"".join(map(frame, payloads))
    places = data.draw(st.lists(st.integers(0, len(sent)), max_size=8))
    ends = sorted({0, len(sent), *places})
    reader = FrameReader(counts := Counts())
    parts = [sent[a:b] for a, b in zip(ends, ends[1:], strict=False)]
    assert feed_all(reader, parts) == payloads
    assert reader.waiting == 0
    assert (counts.n_bytes, counts.damaged, counts.strange) == (len(sent), 0, 0)


@pytest.mark.parametrize("n", [255, 256, MOST_PAYLOAD])
def test_long_heads(n):
    """A payload of 255 bytes may have either head; no other length has two."""
    payload = bytes(n)
    sent = b"\x03" + n.to_bytes(2, "big") + payload + crc_hqx(payload, 0).to_bytes(2, "big") + b"\3"
    assert FrameReader(Counts()).feed(sent) == [payload]
    for wrong in (254, MOST_PAYLOAD + 1):
        assert FrameReader(Counts()).feed(b"\x03" + wrong.to_bytes(2, "big") + sent[3:]) == []


@patient
@given(bit=st.integers(0, 79))
def test_one_wrong_bit_is_seen(bit):
    sent = bytearray(set_rpm(3000))
    sent[bit // 8] ^= 1 << bit % 8
    firmware = VescFirmware(1, STRAIGHT)
    assert firmware.feed(bytes(sent)) == []


@patient
@given(noise=st.binary(max_size=200), n=st.integers(0, 9))
def test_frames_after_damage_are_read(noise, n):
    """A false length hides at most the next `LONGEST` bytes, and loses none of them."""
    reader = FrameReader(counts := Counts())
    brake = set_current_brake(5000)
    lost = set_rpm(3000)[:n]
    read = feed_all(reader, [noise, lost, *[brake] * (LONGEST // len(brake) + 2)])
    assert read[-1] == brake[2:-3]
    assert len(read) >= LONGEST // len(brake) + 1 - reader.waiting // len(brake)
    assert reader.waiting < LONGEST
    assert counts.n_bytes == counts.strange + reader.waiting + sum(len(frame(p)) for p in read)


def an_answer(**values):
    return write_values(VescValues(**{"erpm": 0, "voltage": 0.0, "fault": 0, **values}))


def test_layout_of_the_values():
    answer = an_answer(erpm=-4614, voltage=11.7, fault=3)
    assert len(answer) == 74
    assert answer[23:27] == struct.pack(">i", -4614)
    assert answer[27:29] == struct.pack(">h", 117)
    assert answer[53] == 3
    assert read_values(answer) == VescValues(erpm=-4614, voltage=11.7, fault=3)
    # Older firmware sends fewer values; a message that ends before the fault is no answer.
    assert read_values(answer[:54]) == read_values(answer)
    assert read_values(answer[:53]) is None
    assert read_values(b"\x05" + answer[1:]) is None


def test_values_that_do_not_fit_are_cut():
    assert read_values(an_answer(erpm=2**40, voltage=1e9)).erpm == 2**31 - 1
    assert read_values(an_answer(voltage=-1e9)).voltage == -3276.8


@patient
@given(speed=st.floats(-5, 5), voltage=st.floats(0, 60), fault=st.integers(0, 255), how=st.data())
def test_telemetry_comes_back(speed, voltage, fault, how):
    options = VescOptions(speed_to_erpm=how.draw(st.sampled_from([4614.0, -3000.0])))
    driver, firmware = VescDriver(options), VescFirmware(1, options)
    says = [MotionReading(UNNAMED, speed), StatusReading(UNNAMED, voltage, fault)]
    assert firmware.encode(says) == b"", "nobody has asked"
    firmware.feed(driver.ask())
    answer = firmware.encode(says)
    assert firmware.encode(says) == b"", "answered"
    motion, status = driver.telemetry.feed(answer)
    assert motion.speed == pytest.approx(speed, abs=0.6 / 3000.0)
    assert status.voltage == pytest.approx(voltage, abs=0.051)
    assert status.fault == fault
    again = [r for b in single(answer) for r in driver.telemetry.feed(b)]
    assert again == [motion, status]


def test_other_answers_are_skipped():
    telemetry = VescDriver(VescOptions()).telemetry
    # The answer to FW_VERSION and a printed text.
    assert telemetry.feed(frame(b"\x00\x06\x02VESC6\x00") + frame(b"\x15hello")) == []
    assert (telemetry.counts.frames, telemetry.counts.skipped) == (0, 2)


def test_without_telemetry_nothing_is_asked():
    assert VescDriver(VescOptions(telemetry=False)).ask() == b""


def test_limits_of_the_servo():
    """The limits of F1TENTH are narrower than the commanded steering."""
    driver, firmware = VescDriver(VescOptions()), VescFirmware(1, VescOptions())
    (left,) = firmware.feed(driver.drive(1.0, 0.42))
    (right,) = firmware.feed(driver.drive(1.0, -0.42))
    assert left.steering == pytest.approx((0.15 - 0.5304) / -1.2135)
    assert right.steering == pytest.approx((0.85 - 0.5304) / -1.2135)


@pytest.mark.parametrize("wrong", [
    {"speed_to_erpm": 0.0}, {"steering_to_servo": 0.0}, {"servo_min": 0.6}, {"servo_max": 0.5},
    {"servo_max": 1.5}, {"max_speed": 0.0}, {"max_speed": 1e6}, {"max_steering": -0.1},
    {"min_erpm": -1.0}, {"brake_current": 0.0}, {"speed_to_erpm": float("nan")},
])  # fmt: skip
def test_options_that_cannot_be(wrong):
    (name,) = wrong
    with pytest.raises(BridgeError, match=rf"^{name}: expected .*, got "):
        VescOptions(**wrong)
