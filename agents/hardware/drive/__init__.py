"""Drive real cars with policies and controllers (`relpos drive`)."""

from agents.hardware.drive.result import DriveResult
from agents.hardware.drive.run import drive, drive_on

__all__ = ["DriveResult", "drive", "drive_on"]
