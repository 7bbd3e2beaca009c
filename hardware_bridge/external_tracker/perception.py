"""Perception of the cars by an external tracker, in place of `Perception`.

    lines -> Tracks, Headings -> TeamEstimate -> AgentView

The last report of every pair and every node is extrapolated to the current time and written to a
`TeamEstimate`, from which the same code as for our own tracker writes the view.
"""

from __future__ import annotations

import numpy as np

from hardware_bridge.external_tracker.headings import Headings
from hardware_bridge.external_tracker.params import ReadyParams
from hardware_bridge.external_tracker.pending import PendingReports
from hardware_bridge.external_tracker.tracks import Tracks
from relpos_env.interface._view_kernels import forget_all, note_ranges
from relpos_env.interface.views import AgentView, bind_view, make_view
from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.estimate import Status, TeamEstimate
from tracking.kernels.jit import bind
from tracking.measurements import Kind, MeasurementBlock


class ReadyPerception:
    """Perception of one group; used like `relpos_env.interface.perception.Perception`.

    A pair that is reported directly and by the positions of both nodes uses the newer report. The
    status is as reported, usually OK, until it is older than `ReadyParams.stale`, then LOST; ABSENT
    before the first report and after a node has left. Static nodes may be reported once. Estimates
    are for the current time.
    """

    def __init__(
        self,
        constellation: Constellation,
        params: ReadyParams,
        pending: PendingReports,
        block: MeasurementBlock,
        powered: Bool,
        n_rangefinders: int = 0,
    ) -> None:
        """Create a perception without reports.

        Args:
            constellation: The nodes; the first ones are on the cars, in the cars' order.
            params: Parameters of the external tracker.
            pending: Reports, filled by the caller before every step and emptied by it.
            block: Measurements, of which departures and ranges are used.
            powered: True for present cars, (1, car); written by the caller before every step.
            n_rangefinders: Number of distance sensors of each car.
        """
        group, n_cars = constellation, powered.shape[1]
        self.constellation, self._params, self._pending = group, params, pending
        self._i, self._j = group.pairs.T
        moves = ~group.is_static
        ends = moves[self._i].astype(np.float64) + moves[self._j]
        self._nodes = self._tracks(moves.astype(np.float64))
        self._pairs = self._tracks(ends)
        self._headings = Headings(group.n_nodes)
        self.view: AgentView = make_view(1, n_cars, n_rangefinders)
        self.estimate = TeamEstimate.empty(group, np.zeros(1))
        """Current estimates, overwritten by every step."""
        self._turns: F64 = np.zeros((1, group.n_nodes))
        self.rebind(block, powered)

    def share(self, target: F64, has_target: Bool, command: F64) -> None:
        """Bind the arrays of the task to the view; see `Perception.share`."""
        self.view = self.view._replace(target=target, has_target=has_target, command=command)
        self.rebind(self._block, self._powered)

    def reset(self, env: int = 0) -> None:
        """Discard all reports and estimates."""
        everyone = np.arange(self.constellation.n_nodes)
        self._nodes.forget(everyone)
        self._pairs.forget(np.arange(self.constellation.n_pairs))
        for node in everyone.tolist():
            self._headings.forget(node)
        self._pending.clear()
        forget_all(self.view, env)

    @property
    def n_late(self) -> I64:
        """Number of late measurements, (1): always 0."""
        return np.zeros(1, dtype=np.int64)

    @property
    def n_waiting(self) -> I64:
        """Number of queued measurements, (1): always 0."""
        return np.zeros(1, dtype=np.int64)

    def make_room(self, room: int) -> None:
        """Do nothing: measurements are not queued."""

    def rebind(self, block: MeasurementBlock, powered: Bool) -> None:
        """Bind the arguments of the kernels; see `Perception.rebind`."""
        self._block, self._powered = block, powered
        self._see = bind_view(self.view, self.estimate, powered, self._turns)
        self._note = bind(
            note_ranges, block.t, block.kind, block.i, block.j, block.values, block.has_power,
            block.valid, self.view,
        )  # fmt: skip

    def step(self) -> None:
        """Process the reports and update the view."""
        now = float(self.view.now[0])
        self._let_go()
        index = self.constellation.pair_index
        self._pairs.take([(int(index[i, j]), place) for i, j, place in self._pending.pairs])
        self._nodes.take(self._pending.nodes)
        self._headings.take(self._pending.headings)
        self._pending.clear()
        self._write_estimate(now)
        self._see()
        self._note()
        self._note_distances()

    def _tracks(self, ends: F64) -> Tracks:
        """Create one filter per track with 0, 1 or 2 moving ends, (track)."""
        p, root = self._params, np.sqrt(ends)
        return Tracks(len(ends), root * p.accel_psd, root * p.top_speed, p.std, p.vel_std)

    def _let_go(self) -> None:
        """Discard nodes that have left, except static ones."""
        block = self._block
        leaves = block.valid[0] & (block.kind[0] == Kind.LEAVE)
        for node in block.i[0, leaves].tolist():
            if not self.constellation.is_static[node]:
                self._nodes.forget(node)
                self._pairs.forget(np.flatnonzero((self._i == node) | (self._j == node)))
                self._headings.forget(node)

    def _write_estimate(self, now: float) -> None:
        """Write the estimate."""
        e, i, j, pairs = self.estimate, self._i, self._j, self._pairs
        still = self.constellation.is_static
        x, P = pairs.at(now)  # noqa: N806
        place, place_cov = self._nodes.at(now)
        # Times at which both ends are known; positions of static nodes do not age.
        since = np.where(still & np.isfinite(self._nodes.t), now, self._nodes.t)
        by_nodes = np.minimum(since[i], since[j])
        other = by_nodes > pairs.t
        x = np.where(other[:, None], place[j] - place[i], x)
        P = np.where(other[:, None, None], place_cov[i] + place_cov[j], P)  # noqa: N806
        t_report = np.where(other, by_nodes, pairs.t)
        known = np.isfinite(t_report)
        if self.constellation.dimensions == 2:
            x[:, [2, 5]] = 0.0
            P[:, [2, 5], :] = P[:, :, [2, 5]] = 0.0
        e.t[0] = now
        e.pos_ij_w[0] = np.where(known[:, None], x[:, :3], 0.0)
        e.vel_ij_w[0] = np.where(known[:, None], x[:, 3:], 0.0)
        e.cov[0] = np.where(known[:, None, None], P, 0.0)
        e.age[0] = np.where(known, np.maximum(now - t_report, 0.0), 0.0)
        e.nlos_prob[0] = np.where(other, 0.0, pairs.nlos)
        e.status[0] = self._status(np.where(other, Status.OK, pairs.status), known)
        e.q_wb[0] = self._headings.q_wb
        e.has_orientation[0] = self._headings.known(now, self._params.stale)
        self._turns[0] = self._headings.turns(now)

    def _status(self, reported: I64, known: Bool) -> I64:
        """Return the reported status, LOST if too old, ABSENT if unknown, (pair)."""
        old = (self.estimate.age[0] > self._params.stale) & (reported >= Status.OK)
        status = np.where(old, Status.LOST, reported)
        return np.where(known, status, Status.ABSENT)

    def _note_distances(self) -> None:
        """Store positions as ranges, too, for readers of ranges."""
        e, view, n = self.estimate, self.view, self.view.t_last_range.shape[1]
        cars = (self._i < n) & (self._j < n) & (e.status[0] != Status.ABSENT)
        i, j = self._i[cars], self._j[cars]
        t_report = e.t[0] - e.age[0, cars]
        length = np.linalg.norm(e.pos_ij_w[0, cars], axis=1)
        newer = (t_report > view.t_last_range[0, i, j]) & (e.age[0, cars] <= self._params.stale)
        for a, b in ((i, j), (j, i)):
            view.t_last_range[0, a[newer], b[newer]] = t_report[newer]
            view.distance[0, a[newer], b[newer]] = length[newer]
            view.gap[0, a[newer], b[newer]] = 0.0
