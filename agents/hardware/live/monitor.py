"""Monitor of a live or replayed swarm: rates, counts, estimates and measurements."""

from __future__ import annotations

from typing import Any

from agents.hardware.live.checks import Checks
from agents.hardware.live.history import History
from agents.hardware.live.rates import Rates
from agents.hardware.live.snapshot import Snapshot, take_snapshot
from hardware_bridge.live.swarm import LiveSwarm
from tracking.measurements import MeasurementBlock


class Monitor:
    """Collects statistics of a swarm; call `after_step` after each of its steps."""

    def __init__(
        self,
        swarm: LiveSwarm,
        *,
        estimates: bool = True,
        measurements: bool = False,
        checks: Checks | None = None,
    ) -> None:
        """Begin to monitor a swarm.

        Args:
            swarm: Swarm to monitor; its `tap` is replaced.
            estimates: Whether to keep all estimates.
            measurements: Whether to keep all measurements.
            checks: Checks of the measurements.
        """
        self.swarm = swarm
        self.rates = Rates(swarm.group.n_nodes)
        self.history = History(swarm.group)
        self.t_ns = swarm.intake.start_ns
        """[ns] Host time of the last step."""
        self.decisions = 0
        self._estimates, self._measurements, self._checks = estimates, measurements, checks
        self._found: list[str] = []
        self._blocks: list[MeasurementBlock] = []
        swarm.tap = self._take

    def after_step(self, t_ns: int) -> list[str]:
        """Record a step of the swarm at a host time [ns]; return notices of its checks."""
        self.t_ns = t_ns
        self.decisions += 1
        self.rates.close(self.swarm.intake.seconds(t_ns))
        if self._estimates:
            self.history.add(t_ns, self.swarm.estimate)
        found, self._found = self._found, []
        return found

    def snapshot(self) -> Snapshot:
        """Return a snapshot after the last step."""
        return take_snapshot(self.swarm, self.rates.hz, self.t_ns)

    @property
    def block(self) -> MeasurementBlock:
        """Uncalibrated measurements, empty if not kept; times in seconds since the start."""
        parts = self._blocks
        return MeasurementBlock.concatenate(parts) if parts else MeasurementBlock.empty()

    @property
    def counts(self) -> dict[str, Any]:
        """Numbers of measurements and of refused readings as a JSON record."""
        intake = self.swarm.intake
        return {
            "measurements": dict(self.rates.totals),
            "refused": dict(sorted((intake.refused + intake.plausibility.refused).items())),
            "late_measurements": self.swarm.n_late,
        }

    @property
    def streams(self) -> list[dict[str, Any]]:
        """Decoder statistics of each stream as JSON records."""
        rows = []
        for name, stream in self.swarm.intake.streams.items():
            c = stream.decoder.counts
            counts = {"bytes": c.n_bytes, "frames": c.frames, "skipped": c.skipped}
            rows.append({"stream": name, **counts, "damaged": c.damaged, "strange": c.strange})
        return rows

    def _take(self, block: MeasurementBlock) -> None:
        self.rates.take(block)
        if self._measurements:
            self._blocks.append(block.env(0))
        if self._checks is not None:
            now = self.swarm.intake.seconds(self.t_ns)
            self._found += self._checks.step(now, block)
