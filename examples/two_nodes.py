"""Two nodes of the ranging protocol and a radio between them."""

import heapq
from itertools import count

from tracking.ranging import RangeEvent, Reception, Session, SessionParams, Transmission
from tracking.ranging.frames.airtime import PAPER_PHY, airtime
from tracking.ranging.frames.timestamps import MODULUS, SPEED_OF_LIGHT, TICK_HZ, unwrap

DISTANCE = 7.5  # m
SECONDS = 2.0


class Node:
    """A session with a clock that is off by some ppm."""

    def __init__(self, node_id: int, ppm: float, offset: int) -> None:
        self.session = Session(node_id, SessionParams(), boot=17 * node_id)
        self.rate, self.offset = TICK_HZ * (1.0 + 1e-6 * ppm), offset
        self.on_air_until = 0.0

    def clock(self, t: float) -> int:
        return round(self.offset + t * self.rate)

    def time_of(self, stamp: int, near: float) -> float:
        return (unwrap(stamp, self.clock(near)) - self.offset) / self.rate


nodes = [Node(0, 20.0, 123_456), Node(1, -20.0, MODULUS - 5_000_000_000)]
events: list[tuple[float, int, str, Node, object]] = []  # time, order, what, node, with what
order = count()


def plan(t: float, what: str, node: Node, data: object = None) -> None:
    heapq.heappush(events, (t, next(order), what, node, data))


def act_on(outputs: list, node: Node, t: float) -> None:
    for output in outputs:
        if isinstance(output, Transmission):
            moment = node.time_of(output.at, t)
            start = moment - PAPER_PHY.header_time
            end = start + airtime(PAPER_PHY, len(output.data))
            node.on_air_until = end
            for other in nodes:
                if other is not node:
                    arrival = other.clock(moment + DISTANCE / SPEED_OF_LIGHT) % MODULUS
                    plan(start + PAPER_PHY.detect, "preamble", other)
                    plan(end, "frame", other, (output.data, Reception(arrival, -80.0, -83.0)))
        elif isinstance(output, RangeEvent):
            ranges.append(output.distance)
        else:
            print(f"{t:7.4f} s  node {node.session.id}: {output}")
    plan(max(t, node.time_of(node.session.deadline, t)), "timeout", node)


ranges: list[float] = []
for k, node in enumerate(nodes):
    plan(0.013 * k, "start", node)
while events[0][0] < SECONDS:
    t, _, what, node, data = heapq.heappop(events)
    now = node.clock(t) % MODULUS
    if what == "timeout":
        if node.time_of(node.session.deadline, t) <= t + 1e-9:
            act_on(node.session.timeout(node.session.deadline), node, t)
    elif t < node.on_air_until and what != "start":
        continue  # a transmitting radio does not receive
    elif what == "frame":
        act_on(node.session.frame(*data, now), node, t)
    else:
        act_on(getattr(node.session, what)(now), node, t)

print(f"{len(ranges)} ranges in {SECONDS:g} s, {min(ranges):.4f} to {max(ranges):.4f} m")
assert abs(sum(ranges) / len(ranges) - DISTANCE) < 0.005
