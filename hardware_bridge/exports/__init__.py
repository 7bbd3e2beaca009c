"""Exports of a run for other tools: log folder, MCAP with ROS 2 messages, TUM text."""

from hardware_bridge.exports.log_folder import export_log
from hardware_bridge.exports.mcap import export_mcap
from hardware_bridge.exports.tum import export_tum, tum_text

__all__ = ["export_log", "export_mcap", "export_tum", "tum_text"]
