"""Devices accepted on the line of a car, and the validity time of their messages."""

from pathlib import Path

import numpy as np
import pytest

from hardware_bridge.config import parse_config
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.readings import (
    MICROSECONDS_32,
    ImuReading,
    MotionReading,
    OperatorReading,
    RangeReading,
    Source,
)
from hardware_bridge.wire.definition import HOST
from hardware_bridge.wire.encoder import RelposEncoder

KEY = bytes(range(16))
S = 1_000_000_000
OPERATOR = 65534


@pytest.fixture(params=[None, KEY], ids=["open", "keyed"])
def swarm(request):
    key = f'key = "{request.param.hex()}"' if request.param else ""
    text = "calibration.uncalibrated = true\n"
    for node in (1, 2):
        text += f"""
[nodes.{node}]
vehicle = "car"
[antennas.{node}]
node = {node}
offset_m = [0.0, 0.0, 0.1]
[links.n{node}]
port = "/dev/n{node}"
format = "relpos"
[cars.{node}]
port = "/dev/car{node}"
driver = "relpos"
{key}
"""
    swarm = LiveSwarm(parse_config(text, file="swarm.toml", folder=Path()), 0)
    swarm.key = request.param
    return swarm


def says(swarm, node, t_ns, *readings, line="cars.1", boot=5):
    encoder = RelposEncoder(node, boot, swarm.key)
    source = Source(ticks=t_ns // 1000 % (1 << 32), clock=MICROSECONDS_32)
    data = encoder.encode([r._replace(source=source) for r in readings])
    swarm.take(Chunk(line, t_ns, data))


NOBODY_YET = Source()
MOVES = MotionReading(NOBODY_YET, 0.8, 0.1)
SAMPLE = ImuReading(NOBODY_YET, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8))
RANGE = RangeReading(NOBODY_YET, "2", 1.5)
TRIM = OperatorReading(NOBODY_YET, "1", (1.5, 0.0))


def test_a_car_tells_how_it_moves_until_it_falls_silent(swarm):
    says(swarm, 1, S, MOVES)
    for t, speed in ((1.0, 0.8), (1.4, 0.8), (1.6, 0.0), (60.0, 0.0)):
        swarm.step(round(t * S))
        assert swarm.view.speed[0].tolist() == [speed, 0.0]
    assert not swarm.intake.refused


def test_no_other_device_speaks_on_its_line(swarm):
    for node in (2, 77, HOST):
        says(swarm, node, S, MOVES)
    swarm.step(S)
    assert not swarm.view.speed.any()
    assert swarm.intake.refused["unknown_device"] == 3
    texts = [text for _, text in swarm.intake.notices]
    assert texts[0] == "cars.1: device 2 sends on its line, and is not that car"
    assert len(texts) == 3


@pytest.mark.parametrize(("node", "reading"), [(1, SAMPLE), (1, RANGE), (OPERATOR, TRIM)])
def test_it_says_nothing_but_what_a_controller_says(swarm, node, reading):
    says(swarm, node, S, reading)
    swarm.step(S)
    assert swarm.intake.refused == {"unknown_device": 1}
    assert not swarm.trim.any()
    assert len(swarm.intake.events) == 0
    assert not np.isfinite(swarm.t_last_message()).any()
