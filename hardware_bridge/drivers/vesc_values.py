"""Layout of a VESC's answer to GET_VALUES, for reading and writing.

All numbers are big-endian integers, scaled [1], from the first byte of the payload:

| byte | field | type, scale |
|---|---|---|
| 0 | command, 4 | u8 |
| 1, 3 | temperature of transistors and motor [deg C] | i16 x 10 |
| 5, 9, 13, 17 | currents of motor and input, Id and Iq [A] | i32 x 100 |
| 21 | duty cycle | i16 x 1000 |
| 23 | electrical revolutions per minute | i32 |
| 27 | input voltage [V] | i16 x 10 |
| 29, 33, 37, 41 | charge out and in [Ah], energy out and in [Wh] | i32 x 10000 |
| 45, 49 | tachometer, and without sign | i32 |
| 53 | fault, `mc_fault_code` | u8 |
| 54 | position [deg] | i32 x 10^6 |
| 58 | id of the controller | u8 |
| 59, 61, 63 | temperatures of three transistors [deg C] | i16 x 10 |
| 65, 69 | Vd and Vq [V] | i32 x 1000 |
| 73 | 1: stopped by its timeout; 2: by its kill switch | u8 |

Older firmware ends earlier and newer may append, so nothing after the fault is read.

References:
    [1] VESC firmware 6, comm/commands.c, `COMM_GET_VALUES`. https://github.com/vedderb/bldc
    [2] F1TENTH vesc_driver, vesc_packet.cpp, `VescPacketValues`: the same offsets up to the
        tachometer; its sign of the speed is undone in vesc_to_odom.cpp.
        https://github.com/f1tenth/vesc
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from hardware_bridge.drivers.vesc_frames import GET_VALUES

_LAYOUT = struct.Struct(">B 2h 4i h i h 4i 2i B i B 3h 2i B")
_RPM = struct.Struct(">ih")
_RPM_AT = 23
_FAULT_AT = 53


@dataclass(frozen=True, slots=True, kw_only=True)
class VescValues:
    """The values in use."""

    erpm: int
    """[1/min] Electrical revolutions."""
    voltage: float
    """[V] Battery voltage."""
    fault: int
    """`mc_fault_code` of the firmware; 0 is no fault."""


def read_values(payload: bytes) -> VescValues | None:
    """Return the values of an answer; None if it is no answer to GET_VALUES, or too short."""
    if len(payload) <= _FAULT_AT or payload[0] != GET_VALUES:
        return None
    erpm, tenths = _RPM.unpack_from(payload, _RPM_AT)
    return VescValues(erpm=erpm, voltage=tenths / 10, fault=payload[_FAULT_AT])


def write_values(values: VescValues) -> bytes:
    """Return a payload with these values, clipped to the layout, and zeros for all others."""
    erpm = min(max(values.erpm, -(2**31)), 2**31 - 1)
    tenths = min(max(round(values.voltage * 10), -(2**15)), 2**15 - 1)
    head = (GET_VALUES, 0, 0, 0, 0, 0, 0, 0, erpm, tenths, 0, 0, 0, 0, 0, 0, values.fault & 255)
    return _LAYOUT.pack(*head, 0, 0, 0, 0, 0, 0, 0, 0)
