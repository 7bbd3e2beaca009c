"""Distance sensors of real cars: from the wire to the observation of a policy."""

import math

import numpy as np
import pytest

from agents.errors import UsageError
from agents.hardware.drive.run import drive_on
from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.virtual import VirtualBridge
from hardware_bridge.config import parse_config
from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.errors import BridgeError
from hardware_bridge.ingest.rangefinder import LASTS, Near
from hardware_bridge.readings import MICROSECONDS_32, NearReading, Source
from hardware_bridge.wire.encoder import RelposEncoder
from relpos_env.errors import EnvError
from relpos_env.interface.rangefinders import FARTHEST

RING = EmulateOptions(scenario="cars-nlos", cars=3, proximity=8, seed=2, seconds=60.0)


def test_a_ring_goes_over_the_wire():
    encoder, decoder = RelposEncoder(1, 1), RelposDecoder()
    source = Source(device="1", ticks=7, clock=MICROSECONDS_32)
    sent = [NearReading(source, 0.8 * k, None if k == 3 else 0.1 * k) for k in range(8)]
    got = decoder.feed(encoder.encode(sent))
    assert [r.distance for r in got] == pytest.approx([r.distance for r in sent])
    turns = [
        math.remainder(r.bearing - s.bearing, 2.0 * math.pi) for r, s in zip(got, sent, strict=True)
    ]
    assert np.abs(turns).max() < 1e-4


def test_a_beam_tells_what_is_nearest_in_its_sector_for_a_while():
    near = Near(2, 4)
    assert not near.distances(0).any()
    near.take(0, 0.1, 2.0, 0)
    near.take(0, -0.6, 1.0, 0)  # the same sector, ahead
    near.take(0, math.pi / 2, None, 0)
    near.take(0, -math.pi / 2, 9.0, 0)
    near.take(5, 0.0, 1.0, 0)  # no such car
    near.take(0, math.nan, 1.0, 0)
    assert near.distances(0)[0].tolist() == [1.0, FARTHEST, 0.0, FARTHEST]
    later = round(LASTS * 1e9)
    near.take(0, 0.0, 2.5, later + 1)
    assert near.distances(later + 1)[0].tolist() == [2.5, 0.0, 0.0, 0.0]
    assert not near.distances(later + 1)[1].any()


def test_emulated_cars_see_what_simulated_ones_see():
    bridge = VirtualBridge(RING)
    env = bridge.env()
    assert env.fields[-1].name == "near"
    observations, _ = env.reset(seed=0)
    assert all(env.observation_space(a).contains(o) for a, o in observations.items())
    for _ in range(20):
        observations, *_ = env.step({a: np.array([0.3, 0.2], np.float32) for a in env.agents})
        seen = np.array([observations[a][-8:] for a in env.agents])
        true = bridge.rig.world.near()
        assert (seen > 0.0).any(axis=1).all()
        assert np.median(np.abs(seen - true)) < 0.1
    bridge.close()


def test_policies_with_beams_drive_cars_that_have_them():
    result = drive_on(
        lambda: VirtualBridge(RING), 3, n_rangefinders=8, name="consensus", seconds=3.0
    )
    assert result.decisions == 30
    with pytest.raises(
        UsageError, match="hold-beams: expected 16 distance sensors, the cars have 8"
    ):
        drive_on(lambda: VirtualBridge(RING), 3, n_rangefinders=8, name="hold-beams", seconds=3.0)


def test_a_number_of_beams_is_checked():
    text = VirtualBridge(RING).config.text
    with pytest.raises(BridgeError, match=r"task.proximity: expected 0 to 32, got 99"):
        parse_config(
            text.replace("proximity = 8", "proximity = 99"), file="swarm.toml", folder=None
        )
    with pytest.raises(EnvError, match="proximity: expected a whole number from 0 to 32"):
        EmulateOptions(proximity=40)
