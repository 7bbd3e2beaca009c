"""Relative positions of a group of moving nodes from UWB ranges and inertial sensors.

The package is pure: measurements and times come in as arrays, estimates go out as arrays.
It reads no clock, opens no port and starts no thread.

Conventions, valid everywhere:

- SI units. Times are seconds on one session clock. Float arrays are float64.
- World frame ``w``: x east, y north (magnetic where headings are magnetic), z up.
  Body frame ``b``: x forward, y left, z up. A name ends in the letter of its frame:
  ``accel_b``, ``vel_w``. ``R_wb`` and the quaternion ``q_wb`` (w x y z) map body to world.
- ``pos_ij`` is the position of node j relative to node i, ``p_j - p_i``.
- The leading axis of every array is ``env``, one per independent group; a log or a live
  stream has one. Nodes, pairs and antennas are indexed in the order of
  :class:`Constellation`; ids appear at the borders only.
- Missing data is a mask, never a special value.
"""

from tracking.constellation import Antenna, Constellation, NodeConfig
from tracking.errors import ConfigError, LogError, TrackingError
from tracking.estimate import Status, TeamEstimate
from tracking.measurements import Kind, MeasurementBlock
from tracking.tracker import Tracker, TrackerParams

__all__ = [
    "Antenna",
    "ConfigError",
    "Constellation",
    "Kind",
    "LogError",
    "MeasurementBlock",
    "NodeConfig",
    "Status",
    "TeamEstimate",
    "Tracker",
    "TrackerParams",
    "TrackingError",
]
