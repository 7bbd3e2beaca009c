"""From bytes to measurements: decoding, sender identification, timing and plausibility.

    Chunk -> Decoder -> Identities -> StreamTime -> Plausibility -> Events

Deterministic: the same chunks with the same times give the same measurements.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from hardware_bridge.clocks import EvenTime
from hardware_bridge.config.swarm import CarConfig, LinkConfig, SwarmConfig
from hardware_bridge.decoders import make_decoder
from hardware_bridge.drivers import make_driver
from hardware_bridge.external_tracker.source import OtherTracker
from hardware_bridge.identity import Identities, Verdict
from hardware_bridge.identity.verdict import Mark
from hardware_bridge.ingest.at_rest import AtRest
from hardware_bridge.ingest.events import Events
from hardware_bridge.ingest.naming import Naming
from hardware_bridge.ingest.operator_trims import Trims
from hardware_bridge.ingest.peers import Peers
from hardware_bridge.ingest.rangefinder import Near
from hardware_bridge.ingest.repeated_samples import RepeatedSamples
from hardware_bridge.ingest.sample_rates import SampleRates
from hardware_bridge.ingest.stream import OF_A_CAR, Stream
from hardware_bridge.links.ports import Chunk
from hardware_bridge.plausibility import Plausibility
from hardware_bridge.readings import (
    UNNAMED,
    ImuReading,
    MotionReading,
    NearReading,
    OperatorReading,
    PairReading,
    PeerReading,
    PoseReading,
    RangeReading,
    Reading,
    ScanReading,
    Source,
    StateReading,
    StatusReading,
)
from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.measurements import Kind


class Intake:
    """Conversion of all streams of a swarm to measurements."""

    def __init__(self, config: SwarmConfig, start_ns: int) -> None:
        """Create an intake without received data.

        Args:
            config: Links and cars.
            start_ns: Host time of 0 s in the measurements [ns].

        Raises:
            BridgeError: A format or driver does not fit its options.
        """
        self.group = config.constellation
        self.start_ns = start_ns
        self.events = Events()
        self.plausibility = Plausibility()
        self.received_ns: dict[int, int] = {}
        """Host time [ns] of each node's last accepted message, by index."""
        self.sensed_ns: dict[int, int] = {}
        """Host time [ns] of each node's last IMU or orientation sample, by index. Ranges measured
        by other nodes do not determine its heading."""
        self.near = Near(config.n_slots, config.task.proximity)
        self.motion: dict[int, tuple[int, MotionReading]] = {}
        """Last motion reading of each car with its host time [ns], by index."""
        self.voltage: dict[int, float] = {}
        """Supply voltage of each node [V], by index."""
        self.fault: dict[tuple[str, int], int] = {}
        """Last fault codes of boards and controllers, 0 is none; by link or car, and index of the
        node."""
        self.refused: Counter[str] = Counter()
        """Number of refused readings, by reason."""
        self.notices: list[tuple[int, str]] = []
        """Time [ns] and text of notices to the user; the reader clears the list."""
        rates = [node.imu_hz for node in self.group.nodes]
        self.sample_rates = SampleRates(rates)
        self.at_rest = AtRest(self.group.nodes)
        self._repeated = RepeatedSamples(rates)
        self._naming = Naming(self.group, self.refused, self.notices)
        own = None if config.alone is None else self.group.index_of[config.alone]
        self._peers = Peers(own, self._naming, self.plausibility, self.refused)
        self.trims = Trims(self._naming, self.refused)
        self.other = OtherTracker(
            start_ns, self.group.ids, self._naming, self.plausibility, self.refused, self.notices
        )
        open_ids, keyed_ids = Identities(), Identities(authenticated=True)
        self._identities = [open_ids, keyed_ids]
        self._signed = {"links": keyed_ids}
        self.streams = {
            link.port.name: self._stream(link, keyed_ids if link.key else open_ids)
            for link in config.links
        }
        for car in config.cars:
            self.streams[car.port.name] = self._telemetry(car)
        self.antennas = [_only_antenna(self.group, node) for node in self.group.ids]

    def take(self, chunk: Chunk) -> None:
        """Process received bytes."""
        stream = self.streams[chunk.link]
        for reading in stream.decoder.feed(chunk.data):
            self._take(stream, reading, chunk.t_ns)
        for identities in self._identities:
            if identities.notices:
                self.notices += identities.notices
                identities.notices.clear()

    def release(self, node: int, t_ns: int) -> None:
        """Accept messages of a quarantined node again, by its id."""
        for identities in self._identities:
            identities.release(node, t_ns)

    def marks(self, ahead: int = 0) -> dict[str, dict[int, Mark]]:
        """Return the newest signed messages, by owner of a key; see `Identities.high_water`."""
        return {who: each.high_water(ahead) for who, each in self._signed.items()}

    def restore(self, marks: Mapping[str, Mapping[int, Mark]]) -> None:
        """Refuse all messages that are not newer than these marks."""
        for who, each in self._signed.items():
            each.restore(marks.get(who, {}))

    def seconds(self, t_ns: int) -> float:
        """Convert host time to the time of the measurements [s]."""
        return (t_ns - self.start_ns) * 1e-9

    def wrong_rate(self, node: int) -> str:
        """Return the notice about a node whose sample rate is not the configured one."""
        rate, given = self.sample_rates.rate[node], self.group.nodes[node].imu_hz
        return (
            f"nodes.{self.group.ids[node]}.imu_hz: {given:g} configured, but {rate:.0f} samples a "
            "second come: orientations would lag behind turns"
        )

    def _stream(self, link: LinkConfig, identities: Identities) -> Stream:
        decoder = make_decoder(link.format, link.key)
        args = link.port.name, decoder, link.node, dict(link.ids), identities
        return Stream(*args, scanner=link.scanner)

    def _telemetry(self, car: CarConfig) -> Stream:
        driver = make_driver(car.driver, car.node, car.options, car.key, 0, lambda: 0)
        # The car's controller numbers its own messages: it is not the same device as its node.
        identities = Identities(authenticated=bool(car.key))
        self._identities.append(identities)
        if car.key:
            self._signed[car.port.name] = identities
        ids = {str(car.node): car.node}
        return Stream(car.port.name, driver.telemetry, car.node, ids, identities, is_car=True)

    def _take(self, stream: Stream, reading: Reading, arrival_ns: int) -> None:
        source = reading.source
        if stream.is_car and not isinstance(reading, OF_A_CAR):
            self.refused["unknown_device"] += 1
            return
        if isinstance(reading, OperatorReading):
            self.trims.take(stream, reading, arrival_ns)
            return
        if isinstance(reading, PairReading | PoseReading):
            nodes = self.other.take(stream, reading, arrival_ns)
            if nodes and isinstance(reading, PoseReading) and reading.speed is not None:
                moves = MotionReading(reading.source, speed=reading.speed)
                self.motion[nodes[0]] = arrival_ns, moves
            self.received_ns.update(dict.fromkeys(nodes, arrival_ns))
            return
        node = self._naming.index(stream, source.device, arrival_ns)
        if node is None or self._peers.are_measured_elsewhere(stream, node):
            return
        if source is not stream.source or source is UNNAMED:
            self._judge(stream, source, node, arrival_ns)
        if not stream.verdict.accepted:
            return
        if isinstance(reading, ScanReading):
            self.near.take_scan(node, reading, stream.scanner, arrival_ns)
            return
        if isinstance(reading, NearReading):
            self.near.take(node, reading.bearing, reading.distance, arrival_ns)
            return
        is_used = self._use(stream, reading, node, stream.t_ns, arrival_ns)
        if is_used and stream.name.startswith("links."):
            self.received_ns[node] = arrival_ns

    def _judge(self, stream: Stream, source: Source, node: int, arrival_ns: int) -> None:
        """Check the identity of the sender of a message and determine the time of measurement."""
        verdict = stream.identities.check(stream.name, source, arrival_ns, self.group.ids[node])
        stream.source, stream.verdict = source, verdict
        if not verdict.accepted:
            self.refused[verdict.value] += 1
            return
        clock = stream.clock(node, source)
        if verdict is Verdict.REBOOT:
            clock.restart()
        stream.t_ns = clock.map(source.ticks, arrival_ns)

    def _use(self, stream: Stream, reading: Reading, node: int, t_ns: int, arrival_ns: int) -> bool:
        """Convert a reading to measurements; return whether it was accepted."""
        t = self.seconds(t_ns)
        match reading:
            case ImuReading(gyr=gyr, acc=acc, mag=mag):
                if not self.plausibility.allows_imu(reading) or self._repeats(
                    reading.source, node, (*gyr, *acc), arrival_ns
                ):
                    return False
                if reading.source.ticks is None:
                    even = stream.even.setdefault(node, EvenTime(self.group.nodes[node].imu_hz))
                    t = self.seconds(even.map(None, arrival_ns))
                config = self.group.nodes[node]
                if mag is not None:
                    self.events.add(t, Kind.MAG, node, config.mag_axes.turn_one(mag))
                gyr, acc = config.imu_axes.turn_one(gyr), config.imu_axes.turn_one(acc)
                self.events.add(t, Kind.IMU, node, (*gyr, *acc))
                if self.sample_rates.note(node, arrival_ns):
                    self.notices.append((arrival_ns, self.wrong_rate(node)))
                self.notices += self.at_rest.note(node, (*gyr, *acc), arrival_ns)
                self.sensed_ns[node] = arrival_ns
            case StateReading(q_wb=q, accel_w=accel):
                if not self.plausibility.allows_state(reading) or self._repeats(
                    reading.source, node, (*q, *accel), arrival_ns
                ):
                    return False
                self.events.add(t, Kind.STATE, node, (*q, *accel, 0.0))
                self.sensed_ns[node] = arrival_ns
            case PeerReading():
                return self._use_peer(stream, reading, node, t, arrival_ns)
            case RangeReading():
                return self._use_range(stream, reading, node, t_ns, arrival_ns)
            case MotionReading():
                self.motion[node] = arrival_ns, reading
            case StatusReading():
                self._note_status(stream, node, reading, arrival_ns)
        return True

    def _repeats(
        self, source: Source, node: int, values: tuple[float, ...], arrival_ns: int
    ) -> bool:
        """Return whether a sample is repeated; a frozen sensor is reported once."""
        known = node in self._repeated.stuck
        why = self._repeated.refusal(node, source, values, arrival_ns)
        if why:
            self.refused[why] += 1
        if why == "stuck" and not known:
            text = f"node {self.group.ids[node]} repeats its last sample: its sensor is stuck"
            self.notices.append((arrival_ns, text))
        return bool(why)

    def _use_peer(self, stream: Stream, r: PeerReading, sender: int, t: float, now_ns: int) -> bool:
        node = self._peers.node_of(stream, r, sender, now_ns)
        if node is None:
            return False
        self.events.add(t - r.age, Kind.STATE, node, (*r.q_wb, *r.accel_w, r.noise))
        self.received_ns[node] = max(now_ns - round(1e9 * r.age), self.received_ns.get(node, 0))
        return True

    def _use_range(
        self, stream: Stream, reading: RangeReading, node: int, t_ns: int, arrival_ns: int
    ) -> bool:
        near: int | None = node
        if reading.nearer is not None:
            near = self._naming.index(stream, reading.nearer, arrival_ns)
        far = self._naming.index(stream, reading.to, arrival_ns, named=True)
        if near is None or far is None or far == near:
            return False
        if not self.plausibility.allows_range(near, far, reading.distance, t_ns):
            return False
        antennas = self.antennas[near], self.antennas[far]
        powers = reading.rx_power, reading.fp_power
        values = (reading.distance,)
        if powers[0] is not None and powers[1] is not None:
            values = (reading.distance, powers[0], powers[1])  # type: ignore[assignment]
        self.events.add_range(self.seconds(t_ns), (near, far), antennas, values)
        if stream.name.startswith("links."):
            self.received_ns[near] = self.received_ns[far] = arrival_ns  # the far node answered
        return True

    def _note_status(self, stream: Stream, node: int, reading: StatusReading, t_ns: int) -> None:
        if reading.voltage is not None:
            self.voltage[node] = reading.voltage
        fault = reading.fault
        if fault == self.fault.get((stream.name, node), 0):
            return
        self.fault[stream.name, node] = fault
        what = f"reports fault {fault}" if fault else "reports no fault any more"
        self.notices.append((t_ns, f"{stream.name}: node {self.group.ids[node]} {what}"))


def _only_antenna(group: Constellation, node: int) -> int:
    """Return the index of the antenna used for a node's ranges; the first of several."""
    try:
        return group.antenna_index(node, None)
    except ConfigError:
        return next(k for k, antenna in enumerate(group.all_antennas) if antenna.node == node)
