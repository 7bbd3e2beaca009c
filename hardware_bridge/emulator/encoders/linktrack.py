"""Encoder of a LinkTrack node: Node_Frame3 of ranges, Node_Frame2 with an IMU sample."""

from __future__ import annotations

import re

from hardware_bridge.decoders.linktrack import (
    HEAD_2,
    HEAD_3,
    LAYOUTS,
    NEIGHBOUR_2,
    NEIGHBOUR_3,
    NODE_FRAME_2,
    NODE_FRAME_3,
    ROLES,
    START,
)
from hardware_bridge.emulator.encoders.ticks import moments, ticks_on
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import (
    MILLISECONDS_32,
    ImuReading,
    RangeReading,
    Reading,
    StatusReading,
)

NAME = re.compile(r"([ATC]?)([0-9]{1,3})")
ROLE_OF = {letter: role for role, letter in ROLES.items()}
MOST_MILLIMETRES = (1 << 23) - 1


def role_and_number(name: str) -> tuple[int, int] | None:
    """Return the role and number of a name written by `linktrack.name_of`."""
    match = NAME.fullmatch(name)
    if match is None or int(match[2]) > 255:
        return None
    return ROLE_OF[match[1]], int(match[2])


class LinkTrackEncoder:
    """A node that sends its readings; `device` is its name, such as "1"."""

    def __init__(self, device: str) -> None:
        own = role_and_number(device)
        if own is None:
            raise BridgeError(f"device {device!r} is no LinkTrack node; call it 0 to 255")
        self._role, self._number = own

    def encode(self, readings: list[Reading]) -> bytes:
        """Return a frame per instant, and one for each further IMU sample."""
        return b"".join(map(self._moment, moments(readings)))

    def _moment(self, readings: list[Reading]) -> bytes:
        samples = [r for r in readings if isinstance(r, ImuReading)]
        ranges = [r for r in readings if isinstance(r, RangeReading) and role_and_number(r.to)]
        states = [r.voltage for r in readings if isinstance(r, StatusReading)]
        if not samples and not ranges and not states:
            return b""
        time = ticks_on(MILLISECONDS_32, readings[0])
        voltage = states[0] if states and states[0] is not None else 0.0
        first = self._frame(samples[0] if samples else None, ranges, voltage, time)
        return first + b"".join(self._frame(imu, [], voltage, time) for imu in samples[1:])

    def _frame(
        self, imu: ImuReading | None, ranges: list[RangeReading], voltage: float, time: int
    ) -> bytes:
        function = NODE_FRAME_3 if imu is None else NODE_FRAME_2
        fixed, each = LAYOUTS[function]
        ranges = ranges[:255]
        length = fixed.size + len(ranges) * each.size + 1
        tail = (round(voltage * 1000.0), len(ranges))
        if imu is None:
            head = HEAD_3.pack(length, self._role, self._number, time, *tail)
        else:
            still = (bytes(9), bytes(9))
            level = (bytes(6), 1.0, 0.0, 0.0, 0.0)
            head = HEAD_2.pack(
                length, self._role, self._number, *still, *imu.gyr, *imu.acc, *level, time, *tail
            )
        frame = bytes((START, function)) + head[2:]
        frame += b"".join(neighbour(function, r) for r in ranges)
        return frame + bytes((sum(frame) & 0xFF,))


def neighbour(function: int, reading: RangeReading) -> bytes:
    """Return the part of a frame that holds one range."""
    other = role_and_number(reading.to)
    assert other is not None
    millimetres = min(round(reading.distance * 1000.0), MOST_MILLIMETRES)
    layout = NEIGHBOUR_3 if function == NODE_FRAME_3 else NEIGHBOUR_2
    powers = (half_decibels(reading.fp_power), half_decibels(reading.rx_power))
    return layout.pack(*other, millimetres.to_bytes(3, "little", signed=True), *powers)


def half_decibels(power: float | None) -> int:
    """Return a power [dBm] in the format's units; 0 is none."""
    return 0 if power is None else min(max(round(power * -2.0), 0), 255)
