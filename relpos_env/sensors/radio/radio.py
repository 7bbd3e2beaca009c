"""The radios of a batch of environments: ranges by the protocol, message by message.

Every node runs the compiled session of `tracking.ranging`; the ranges that come out are those
that the nodes resolve themselves, at the node with the smaller number. A range belongs to the
moment at which that node spoke, and is known a good part of a round later.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.sensors.radio._air_kernels import make_nodes
from relpos_env.sensors.radio._air_state import (
    FLIGHT,
    LATENT,
    NODE,
    RECEPTION,
    RadioNumbers,
    RangeBuffer,
    make_channel,
)
from relpos_env.sensors.radio._channel_kernels import KNOT
from relpos_env.sensors.radio._radio_kernels import Air, Scene, power_nodes, run_window
from relpos_env.sensors.radio.params import RadioSimParams
from tracking.arrays import F64, I64, Bool
from tracking.ranging._session_state import MESSAGE, make_sessions, session_numbers
from tracking.ranging.airtime import airtime, round_rate
from tracking.ranging.members import MAX_MEMBERS
from tracking.ranging.timestamps import TICK_HZ
from tracking.ranging.wire import ENTRY_BYTES, FIXED_BYTES, entries_per_frame


@dataclass(frozen=True, slots=True)
class Ranges:
    """What the radios resolved in one window, padded; (env, slot)."""

    t: F64
    """When it was so [s]."""
    i: I64
    """The node with the smaller number."""
    j: I64
    values: F64
    """Distance [m], received and first-path power [dBm], (env, slot, 3)."""
    nlos: Bool
    """Whether an obstacle stood between."""
    count: I64
    """Slots used, (env)."""


class Radio:
    """The radios and the air of all environments.

    Laws: same seed and motion, same stream; environment k of a batch is that environment
    alone, bit for bit; no errors and no clocks, the distance.
    """

    def __init__(
        self,
        params: RadioSimParams,
        n_nodes: int,
        seeds: list[int],
        dt: float,
        clocks: F64 | None = None,
    ) -> None:
        """Set everything up; no node is switched on.

        Args:
            params: What the radios do.
            n_nodes: In each environment.
            seeds: One for each environment, 0 to 2^63.
            dt: Length of a window [s].
            clocks: How much faster each node's clock runs than a perfect one, (node) [1];
                drawn if it is None.

        Raises:
            EnvError: More nodes than a message has room for.
        """
        phy = params.session.phy
        most = min(MAX_MEMBERS, entries_per_frame(phy.max_frame) + 1)
        if n_nodes > most:
            raise EnvError(
                f"radio: expected at most {most} nodes with frames of {phy.max_frame} bytes, "
                f"got {n_nodes}"
            )
        self._dt, self._window = dt, 0
        self._seeds = np.array(seeds, dtype=np.uint64)
        self._numbers = session_numbers(params.session, n_nodes)
        self._channel = make_channel(params.channel, KNOT)
        rows = np.arange(len(self._numbers.frame))
        self._radio = RadioNumbers(
            phy.header_time,
            phy.detect,
            params.capture,
            params.clock_wander,
            np.array([airtime(phy, FIXED_BYTES + ENTRY_BYTES * int(k)) for k in rows]),
        )
        e, n = len(seeds), n_nodes
        sessions, peers = make_sessions(e, n)
        self._air = Air(
            np.zeros((e, n), dtype=NODE),
            np.zeros((e, n, n), dtype=LATENT),
            sessions,
            peers,
            np.zeros((e, n), dtype=MESSAGE),
            np.zeros((e, n, n), dtype=np.int64),
            np.zeros((e, n + 1), dtype=RECEPTION),
            np.zeros((e, n), dtype=FLIGHT),
            np.full((e, n), np.inf),
        )
        self._air.latents["knot"] = -1
        self._air.receptions["src"] = -1
        self._air.flights["detect"] = self._air.flights["end"] = np.inf
        for k in range(e):
            make_nodes(
                self._air.nodes[k], self._seeds[k], params.clock_offset, params.antenna_delay_std
            )
        if clocks is not None:
            self._air.nodes["rate"] = TICK_HZ * (1.0 + clocks)
        pairs = n * (n - 1) // 2
        room = pairs * (2 + int(np.ceil(dt * round_rate(phy, max(n, 2)))))
        self._out = RangeBuffer(
            np.zeros((e, room)),
            np.zeros((e, room), dtype=np.int64),
            np.zeros((e, room), dtype=np.int64),
            np.zeros((e, room, 3)),
            np.zeros((e, room), dtype=bool),
            np.zeros(e, dtype=np.int64),
        )

    def switch_on(self, env: int, node: int, *, boot: int, after: float = 0.0) -> None:
        """Give a node power, so many seconds after the start of the next window."""
        power_nodes(self._numbers, self._air, env, node, True, boot, after)

    def switch_off(self, env: int, node: int) -> None:
        """Take a node's power at the start of the next window."""
        power_nodes(self._numbers, self._air, env, node, False, 0, 0.0)

    def step(
        self, pos0: F64, pos1: F64, boxes: F64 | None = None, capsules: F64 | None = None
    ) -> Ranges:
        """Go through one window.

        Args:
            pos0: Antennas at its start, (env, node, 3) [m].
            pos1: Antennas at its end.
            boxes: What stands in the plane: centre x y, half width, half depth [m], cosine and
                sine of the angle, (env, box, 6).
            capsules: What stands in space: two ends and the radius [m], (env, capsule, 7).
        """
        e = len(self._seeds)
        scene = Scene(
            pos0,
            pos1,
            np.zeros((e, 0, 6)) if boxes is None else boxes,
            np.zeros((e, 0, 7)) if capsules is None else capsules,
        )
        run_window(
            self._numbers,
            self._radio,
            self._channel,
            self._seeds,
            self._window,
            self._dt,
            self._air,
            scene,
            self._out,
        )
        start = self._window * self._dt
        self._window += 1
        out, used = self._out, int(self._out.used.max())
        return Ranges(
            start + out.t[:, :used],
            out.i[:, :used].copy(),
            out.j[:, :used].copy(),
            out.values[:, :used].copy(),
            out.nlos[:, :used].copy(),
            out.used.copy(),
        )
