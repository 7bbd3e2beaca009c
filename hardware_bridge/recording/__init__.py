"""Recordings: every byte of every link with its time, in an append-only file."""

from hardware_bridge.recording.format import Header, Kind, Record
from hardware_bridge.recording.reader import Recording, read_recording
from hardware_bridge.recording.recorder import Recorder

__all__ = ["Header", "Kind", "Record", "Recorder", "Recording", "read_recording"]
