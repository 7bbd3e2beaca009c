"""Findings: faults of a recording (`docs/reference/findings.md`)."""

from __future__ import annotations

from tracking.findings.at_rest import correct_at_rest
from tracking.findings.clock_offset import correct_clocks
from tracking.findings.finding import KINDS, Finding, refuse_errors
from tracking.findings.gyroscope import find_gyroscope
from tracking.findings.imu_against_ranges import find_suspects, find_wrong_axes
from tracking.findings.ranges import find_range_errors
from tracking.findings.stamps import find_bad_stamps
from tracking.findings.trials import Progress
from tracking.findings.truth import find_truth_errors
from tracking.findings.turned_magnetometer import correct_magnetometers
from tracking.findings.use import find_in_estimates, find_unused
from tracking.log.folder import Log


def examine(log: Log, progress: Progress = lambda share: None) -> tuple[Log, list[Finding]]:
    """Examine sensor readings, clocks and ranges.

    Args:
        log: A recording.
        progress: Called with the completed share, 0 to 1.

    Returns:
        The log, with gyroscope biases, clocks and turned magnetometers corrected where possible,
        and the findings.
    """
    log, at_rest = correct_at_rest(log)
    found = [*find_unused(log), *find_truth_errors(log), *find_bad_stamps(log), *at_rest]
    if not any(f.name == "gyro-units" for f in found):
        found += find_gyroscope(log)
    if any(f.severity == "error" for f in found):
        return log, found  # the next checks need sensors without errors
    suspects = find_suspects(log, _part(progress, 0.0, 0.2))
    log, of_clocks = correct_clocks(log, suspects, _part(progress, 0.2, 0.6))
    found += of_clocks
    if any(f.severity == "error" for f in of_clocks):
        return log, found
    if of_clocks and suspects:
        suspects = find_suspects(log, _part(progress, 0.6, 0.7))
    if suspects:
        axes = find_wrong_axes(log, list(suspects), _part(progress, 0.7, 1.0))
        return log, [*found, *axes]
    log, of_magnetometers = correct_magnetometers(log, _part(progress, 0.7, 0.9))
    found += of_magnetometers
    return log, [*found, *find_range_errors(log, _part(progress, 0.9, 1.0))]


def _part(progress: Progress, first: float, last: float) -> Progress:
    return lambda share: progress(first + (last - first) * share)


__all__ = [
    "KINDS", "Finding", "examine", "find_in_estimates", "find_unused", "refuse_errors",
]  # fmt: skip
