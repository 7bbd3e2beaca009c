"""Reference simulation of nodes that run the reference session: messages, clocks, collisions.

A test compares the compiled form for batches of environments, `radio`, with this one.
Time advances in windows of one step of the world; inside a window all true times
are seconds since its start.

A free receiver locks on a message when it detects the preamble, also late while the preamble
lasts, and receives nothing else until the message ends. Another message during this time corrupts
it unless weaker by the capture margin. A node that sends, or is about to, receives nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.sensors.radio._air_kernels import (
    local_now,
    make_nodes,
    next_window,
    receive_message,
    true_at,
)
from relpos_env.sensors.radio._air_state import LATENT, NODE, RECEPTION, make_channel
from relpos_env.sensors.radio._channel_kernels import KNOT
from relpos_env.sensors.radio.params import RadioSimParams
from tracking.arrays import F64
from tracking.ranging.events import Event, Output, Reception, Transmission
from tracking.ranging.frames.airtime import airtime
from tracking.ranging.frames.timestamps import MODULUS, unwrap
from tracking.ranging.session import Session

END, DETECT, DEADLINE, POWER = 0, 1, 2, 3
NO_BOXES, NO_CAPSULES = np.zeros((0, 6)), np.zeros((0, 7))


@dataclass(slots=True)
class OnAir:
    """A frame in transmission; times since the start of the window [s]."""

    data: bytes
    moment: float
    """Time of its stamp."""
    detect: float
    end: float
    detected: bool = False


@dataclass(frozen=True, slots=True)
class Sent:
    """A transmitted frame, for observers."""

    t: float
    """True time of its stamp [s]."""
    node: int
    data: bytes


@dataclass(frozen=True, slots=True)
class SessionEvent:
    """An event returned by a session."""

    t: float
    """True time [s]."""
    node: int
    event: Event


class Air:
    """One group of nodes and the channels between them.

    Property: equal parameters, seed and motion give equal results, bit for bit.
    """

    def __init__(self, params: RadioSimParams, n_nodes: int, seed: int, dt: float) -> None:
        """Allocate the state with every node switched off.

        Args:
            params: Parameters of the radios.
            n_nodes: At most 64; node k has the ID k unless `switch_on` sets another one.
            seed: Any number.
            dt: Length of a window [s].
        """
        if n_nodes > 64:
            raise EnvError(f"air: expected at most 64 nodes, got {n_nodes}")
        self._params, self._dt = params, dt
        self._seed = np.uint64(seed)
        self._channel = make_channel(params.channel, KNOT)
        self._nodes = np.zeros(n_nodes, dtype=NODE)
        make_nodes(self._nodes, self._seed, params.clock_offset, params.antenna_delay_std)
        self._latents = np.zeros((n_nodes, n_nodes), dtype=LATENT)
        self._latents["knot"] = -1
        self._receptions = np.zeros(n_nodes, dtype=RECEPTION)
        self._receptions["src"] = -1
        self.sessions: list[Session | None] = [None] * n_nodes
        self._queue: list[list[OnAir]] = [[] for _ in range(n_nodes)]
        self._due = np.full(n_nodes, np.inf)
        self._switch: list[tuple[float, int, Session | None]] = []
        self._window = 0
        self.sent: list[Sent] = []
        """Transmitted frames; callers may clear the list."""
        self.events: list[SessionEvent] = []
        """Events returned by the sessions; callers may clear the list."""

    @property
    def t(self) -> float:
        """True time [s]."""
        return self._window * self._dt

    def switch_on(self, node: int, *, boot: int, at: float = 0.0, id: int | None = None) -> None:
        """Switch a node on, `at` seconds after the start of the next window."""
        name = node if id is None else id
        self._switch.append((at, node, Session(name, self._params.session, boot=boot)))

    def switch_off(self, node: int, *, at: float = 0.0) -> None:
        """Switch a node off, `at` seconds after the start of the next window."""
        self._switch.append((at, node, None))

    def step(
        self, pos0: F64, pos1: F64, boxes: F64 = NO_BOXES, capsules: F64 = NO_CAPSULES
    ) -> None:
        """Simulate one window.

        Args:
            pos0: Antennas at the start of the window, (node, 3) [m].
            pos1: Antennas at the end of the window, (node, 3) [m].
            boxes: Obstacles in the plane, (box, 6).
            capsules: Obstacles in 3D, (capsule, 7).
        """
        self._scene = (pos0, pos1, self._dt), boxes, capsules
        self._nodes["step"] = np.linalg.norm(pos1 - pos0, axis=1)
        for k in range(len(self._due)):
            self._plan(k, 0.0)
        while True:
            t, what, k = self._next()
            if t > self._dt:
                break
            if what == END:
                self._end(k, t)
            elif what == DETECT:
                self._queue[k][0].detected = True
                self._detect(k, t, range(len(self._nodes)))
            elif what == DEADLINE:
                now = max(self._deadline(k), local_now(self._nodes, k, t))
                self._take(k, t, self._session(k).timeout(now % MODULUS))
            else:
                self._power(t)
        next_window(self._nodes, self._seed, self._window, self._params.clock_wander, self._dt)
        self._window += 1
        self._switch = [(at - self._dt, k, session) for at, k, session in self._switch]
        for queue in self._queue:
            for m in queue:
                for name in ("moment", "detect", "end"):
                    setattr(m, name, getattr(m, name) - self._dt)

    def _session(self, k: int) -> Session:
        session = self.sessions[k]
        assert session is not None
        return session

    def _next(self) -> tuple[float, int, int]:
        """Return time, kind and node of the next event."""
        events = [(q[0].end, END, k) for k, q in enumerate(self._queue) if q]
        events += [
            (q[0].detect, DETECT, k) for k, q in enumerate(self._queue) if q and not q[0].detected
        ]
        events += [(float(t), DEADLINE, k) for k, t in enumerate(self._due)]
        events += [(at, POWER, k) for at, k, _ in self._switch]
        return min(events)

    def _power(self, t: float) -> None:
        at, k, session = min(self._switch, key=lambda s: (s[0], s[1]))
        self._switch.remove((at, k, session))
        if self._queue[k] and self._queue[k][0].detected:
            for r in range(len(self._nodes)):
                self._receptions[r]["bad"] |= self._receptions[r]["src"] == k
            self._queue[k] = self._queue[k][:1]  # the broken frame still ends
        else:
            self._queue[k] = []
        self._receptions[k]["src"] = -1
        self.sessions[k] = session
        if session is None:
            self._due[k] = np.inf
        else:
            self._take(k, t, session.start(local_now(self._nodes, k, t) % MODULUS))

    def _detect(self, s: int, t: float, receivers: Iterable[int]) -> None:
        """Lock free receivers on a message, which may corrupt the messages of busy receivers."""
        message = self._queue[s][0]
        for r in receivers:
            if r == s or self.sessions[r] is None or self._queue[r]:
                continue
            before = self._receptions[r].copy()
            if not receive_message(
                self._channel, self._latents, self._seed, self._nodes, s, r, message.moment,
                *self._scene, self._receptions,
            ):  # fmt: skip
                continue
            now = self._receptions[r]
            if before["src"] >= 0:
                spoilt = now["strength"] > before["strength"] - self._params.capture
                self._receptions[r] = before
                self._receptions[r]["bad"] |= spoilt
                continue
            self._take(r, t, self._session(r).preamble(local_now(self._nodes, r, t) % MODULUS))

    def _end(self, s: int, t: float) -> None:
        """End a message: deliver it to the radios locked on it and free these for other ones."""
        message = self._queue[s].pop(0)
        self._nodes[s]["sent"] += 1
        free = [s]
        for r in range(len(self._nodes)):
            if self._receptions[r]["src"] != s:
                continue
            record = self._receptions[r].copy()
            self._receptions[r]["src"] = -1
            free.append(r)
            now, session = local_now(self._nodes, r, t) % MODULUS, self._session(r)
            if record["bad"]:
                self._take(r, t, session.broken(now))
            else:
                reception = Reception(
                    int(record["stamp"]) % MODULUS,
                    float(record["rx_power"]),
                    float(record["fp_power"]),
                    float(record["carrier"]),
                )
                self._take(r, t, session.frame(message.data, reception, now))
        for m, queue in enumerate(self._queue):
            if (
                queue
                and queue[0].detected
                and t < queue[0].moment - self._params.session.phy.detect
            ):
                self._detect(m, t, [r for r in free if self._receptions[r]["src"] < 0])

    def _take(self, k: int, t: float, outputs: list[Output]) -> None:
        """Execute the outputs of a session."""
        for output in outputs:
            if isinstance(output, Transmission):
                self._send(k, output)
            else:
                self.events.append(SessionEvent(self.t + t, k, output))
        self._plan(k, t)

    def _deadline(self, k: int) -> int:
        return unwrap(self._session(k).deadline, local_now(self._nodes, k, 0.0))

    def _plan(self, k: int, t: float) -> None:
        """Update the due time of a node's deadline, t if it has passed."""
        if self.sessions[k] is not None:
            self._due[k] = max(true_at(self._nodes, k, self._deadline(k)), t)

    def _send(self, k: int, order: Transmission) -> None:
        phy = self._params.session.phy
        near = local_now(self._nodes, k, 0.0)
        moment = true_at(self._nodes, k, unwrap(order.at, near))
        start = moment - phy.header_time
        end = start + airtime(phy, len(order.data))
        self._queue[k].append(OnAir(order.data, moment, start + phy.detect, end))
        self.sent.append(Sent(self.t + moment, k, order.data))
