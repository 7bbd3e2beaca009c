"""Test vectors of docs/reference/wire-format.md: bytes of this version never change."""

import re
from pathlib import Path

import pytest
from wire_twin import KEY, frame, payload

from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.drivers.relpos import RelposDriver, RelposOptions
from hardware_bridge.readings import (
    MICROSECONDS_32,
    AckReading,
    DriveReading,
    HeartbeatReading,
    ImuReading,
    MotionReading,
    NearReading,
    OperatorReading,
    PeerReading,
    RangeReading,
    Source,
    StateReading,
    StatusReading,
)
from hardware_bridge.wire import definition as wire
from hardware_bridge.wire.encoder import RelposEncoder

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "wire-format.md"
GYR, ACC, MAG = (0.01, -0.02, 0.03), (0.0, 0.0, 9.81), (20.0, -1.5, -43.25)
TURN = (0.6, 0.0, 0.0, -0.8)


def at(time, node=3, boot=7, sequence=0):
    return Source(str(node), boot, sequence, time, MICROSECONDS_32)


V0, V1, V2, V3, V4, V5, V6, V7, V8, V9, V10, V11 = (at(1000 * k, sequence=k) for k in range(12))
IMU_ROW = [1000, -2000, 3000, 0, 0, 98100]
VECTORS = [
    ([HeartbeatReading(V0)], wire.HEARTBEAT, [[]]),
    ([ImuReading(V1, GYR, ACC)], wire.IMU, [IMU_ROW]),
    ([ImuReading(V2, GYR, ACC, MAG)], wire.IMU_MAG, [[*IMU_ROW, 20000, -1500, -43250]]),
    ([StateReading(V3, TURN, (0.5, -0.25, 0.0))], wire.STATE,
     [[4_800_000, 0, 0, -6_400_000, 5000, -2500, 0]]),
    ([RangeReading(V4, "5", 2.5), RangeReading(V4, "6", 3.1416, -81.25, -83.5),
      RangeReading(V4, "6", 0.75, -70.0, None, "5")], wire.RANGES,
     [[5, 0, 25000, 0, 0, 0, 0], [6, 0, 31416, -8125, -8350, 0, 6], [6, 5, 7500, -7000, 0, 0, 3]]),
    ([MotionReading(V5, -0.5, 0.1)], wire.MOTION, [[-500, 1000, 1]]),
    ([StatusReading(V6, 7.4, 3)], wire.STATUS, [[3, 7400, 1]]),
    ([OperatorReading(V7, "4", (1.0, -0.5))], wire.REMOTE, [[4, 1000, -500]]),
    ([AckReading(V8, 300)], wire.ACK, [[300]]),
    ([DriveReading(V9, "4", 1.5, -0.42, False)], wire.COMMAND, [[4, 1500, -4200, 0]]),
    ([NearReading(V10, 0.5, 1.25), NearReading(V10, -1.0, None)], wire.NEAR,
     [[5000, 1250, 1], [-10000, 0, 0]]),
    ([PeerReading(V11, "5", 0.05, TURN, (0.5, -0.25, 0.0), 0.125)], wire.PEER,
     [[5, 500, 4_800_000, 0, 0, -6_400_000, 5000, -2500, 0, 125]]),
]  # fmt: skip
"""Readings of node 3 and boot 7, their message and the numbers of its rows."""

CODED = [bytes.fromhex(line) for line in
         re.search(r"```text\n(.*?)```", PAGE.read_text(), re.DOTALL)[1].replace(
             "\n  ", " ").splitlines()]  # fmt: skip
PLAIN, SEALED = CODED[: len(VECTORS)], CODED[len(VECTORS) :]


def test_there_are_as_many():
    assert {message for _, message, _ in VECTORS} == set(wire.MESSAGES)
    assert len(CODED) == len(VECTORS) + 3


@pytest.mark.parametrize("k", range(len(VECTORS)))
def test_a_frame_is_the_vector(k):
    readings, message, rows = VECTORS[k]
    assert frame(message.type, 3, 7, k, 1000 * k, payload(message, rows)) == PLAIN[k]
    encoder = RelposEncoder(3, 7)
    encoder.sequence = k
    assert encoder.encode(readings) == PLAIN[k]
    assert RelposDecoder().feed(PLAIN[k]) == readings


def test_the_python_of_the_page_runs():
    (code,) = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.DOTALL | re.MULTILINE)
    names = {}
    exec(compile(code, PAGE.name, "exec"), names)
    assert names["readings"] == [HeartbeatReading(at(1_000_000))]


def test_a_frame_with_mac_is_the_vector():
    readings, message, rows = VECTORS[1]
    assert frame(message.type, 3, 7, 1, 1000, payload(message, rows), KEY) == SEALED[0]
    assert RelposDecoder(KEY).feed(SEALED[0]) == readings
    clock = iter((20_000, 30_000))
    car = RelposDriver(4, RelposOptions(), KEY, 7, lambda: next(clock))
    assert [car.drive(0.5, 0.1), car.neutral()] == SEALED[1:]
