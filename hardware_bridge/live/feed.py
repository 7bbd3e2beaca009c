"""Real-time feed: reads ports, updates trackers and sends heartbeats to the supervisor.

The deciding thread does all of it, so that a heartbeat proves that this thread runs.
"""

from __future__ import annotations

from collections.abc import Callable

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.links import Links
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.marks import KeptMarks
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.recording import Kind, Recorder
from hardware_bridge.safety.messages import Decision, Notice, Order, Report, Telemetry, Word
from hardware_bridge.safety.picture import Picture
from hardware_bridge.safety.process import SupervisorProcess
from relpos_env.timing import DECISION

DECISION_NS = round(DECISION * 1e9)
WORD_NS = 10_000_000
"""[ns] Period of heartbeats."""


class LiveFeed:
    """Ports and supervisor as a `hardware_bridge.live.group.Feed`."""

    def __init__(
        self,
        swarm: LiveSwarm,
        links: Links,
        now_ns: Callable[[], int],
        *,
        supervisor: SupervisorProcess | None = None,
        recorder: Recorder | None = None,
        marks: KeptMarks | None = None,
    ) -> None:
        """Connect open ports and processes.

        Args:
            swarm: Trackers that process the bytes.
            links: Ports with measurements.
            now_ns: The host's monotonic clock [ns].
            supervisor: Supervisor of the cars; None without driving.
            recorder: Recorder of all bytes.
            marks: Replay protection of signed messages.
        """
        self._marks = marks
        self._swarm, self._links, self._now_ns = swarm, links, now_ns
        self._supervisor, self._recorder = supervisor, recorder
        self._index = {name: k for k, name in enumerate(swarm.intake.streams)}
        if supervisor is not None:
            links.watch(supervisor.fileno())
        self._due = now_ns()
        self._heartbeat_ns = 0
        self._reported_full_disk = False
        self.report: Report | None = None
        """Latest report of the gate."""
        self.notices: list[tuple[int, str]] = []
        """Time [ns] and text of notices to the user; the reader clears the list."""
        self.n_late = 0
        """Number of control steps that were due while the previous one was still running."""
        self.attend: Callable[[], None] | None = None
        """Called about every 10 ms while waiting, for keys and screens."""

    def advance(self) -> int:
        """Wait for the next control step; see `Feed`."""
        self._due += DECISION_NS
        now = self._now_ns()
        if now > self._due:
            self.n_late += 1
            self._due = now
        while (now := self._now_ns()) < self._due:
            self._send_heartbeat(now)
            patience = min(self._due - now, WORD_NS)
            for chunk in self._links.wait(patience * 1e-9):
                self._take(chunk)
            self._listen()
            if self.attend is not None:
                self.attend()
        # Bytes received during this processing still belong to this control step.
        for chunk in self._links.wait(0.0):
            self._take(chunk)
        self._listen()
        self._note_links()
        now = self._now_ns()
        self._send_heartbeat(now)
        if self._marks is not None:
            self._marks.keep(now)
        if (report := self.report) is not None:
            names = ("speed", "steering", "armed", "reason")
            applied = {name: getattr(report, name) for name in names}
            self._swarm.apply(**applied)
            if self._recorder is not None:
                said = {name: value.tolist() for name, value in applied.items()}
                self._recorder.add_event(now, "applied", **said)
        if self._recorder is not None:
            self._recorder.add(Kind.TICK, 0, now)
        return now

    def decide(self, picture: Picture) -> None:
        """Send a snapshot to the gate; see `Feed`."""
        if self._supervisor is not None:
            self._supervisor.send(Decision(picture))
            self._heartbeat_ns = self._now_ns()

    def order(self, what: str) -> None:
        """Forward an operator command, see `Order`; ``gone`` dismisses silent cars.

        Raises:
            BridgeError: The supervisor does not accept it.
        """
        if what == "gone":
            self._swarm.silent.dismiss()
        elif self._supervisor is not None and not self._supervisor.send(Order(what)):
            # The supervisor accepts no messages and is ended; the cars then stop by themselves.
            self._supervisor.close()
            raise BridgeError(
                f"supervisor: it did not take {what!r} and was ended; cars stop by their watchdogs"
            )
        self.note(self._now_ns(), what)

    def note(self, t_ns: int, text: str) -> None:
        """Report a line of text to the user and write it to the recording."""
        self.notices.append((t_ns, text))
        if self._recorder is not None:
            self._recorder.add_event(t_ns, "notice", text=text)

    def _take(self, chunk: Chunk) -> None:
        if self._recorder is not None:
            self._recorder.add(Kind.BYTES_IN, self._index[chunk.link], chunk.t_ns, chunk.data)
        self._swarm.take(chunk)

    def _send_heartbeat(self, now: int) -> None:
        if self._supervisor is not None and now - self._heartbeat_ns >= WORD_NS // 2:
            self._supervisor.send(Word(now * 1e-9, self._swarm.t_last_message()))
            self._heartbeat_ns = now

    def _listen(self) -> None:
        if self._supervisor is None:
            return
        for message in self._supervisor.receive():
            match message:
                case Telemetry(car, t_ns, data):
                    name = f"cars.{self._swarm.group.ids[car]}"
                    self._take(Chunk(name, t_ns, data))
                case Report():
                    self.report = message
                case Notice(text):
                    self.note(self._now_ns(), text)
        if self._supervisor.gone:
            # The controllers stop the cars by themselves; there is no process to command them.
            raise BridgeError(
                "supervisor: it is gone, so the cars have stopped; start the drive again"
            )

    def _note_links(self) -> None:
        for notice in self._links.drain_notices():
            state = "up" if notice.up else f"down: {notice.reason}"
            self.note(notice.t_ns, f"{notice.link} {state}")
        intake = self._swarm.intake
        for t_ns, text in intake.notices:
            self.note(t_ns, text)
        intake.notices.clear()
        lost = self._recorder.lost if self._recorder is not None else None
        if lost is not None and not self._reported_full_disk:
            self._reported_full_disk = True
            self.notices.append((self._now_ns(), f"recording fails: {lost}"))
