"""The log folder: a recorded run as plain files, format 1 (`docs/reference/log-format.md`)."""

from tracking.log.folder import Log
from tracking.log.meta import write_range_noise
from tracking.log.read import read_log
from tracking.log.truth import Truth
from tracking.log.write import check_target, write_log

__all__ = ["Log", "Truth", "check_target", "read_log", "write_log", "write_range_noise"]
