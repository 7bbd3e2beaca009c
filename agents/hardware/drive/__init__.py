"""Real cars driven by policies and controllers: what `relpos drive` does."""

from agents.hardware.drive.result import DriveResult
from agents.hardware.drive.run import drive, drive_on

__all__ = ["DriveResult", "drive", "drive_on"]
