"""Conversion of device clocks to the clock of the host."""

from hardware_bridge.clocks.device_time import DeviceTime
from hardware_bridge.clocks.even_time import EvenTime
from hardware_bridge.clocks.params import ClockParams
from hardware_bridge.clocks.stream_time import HostTime, StreamTime

__all__ = ["ClockParams", "DeviceTime", "EvenTime", "HostTime", "StreamTime"]
