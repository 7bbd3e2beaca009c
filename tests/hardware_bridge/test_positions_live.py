"""A swarm with lines of an external tracker: over a pty, over a file, as in the simulator."""

import json
import time
from pathlib import Path

import numpy as np
import pytest
from terminals import FakeDevice

from hardware_bridge.config import parse_config, read_config
from hardware_bridge.emulator.encoders import make_encoder
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.links import Links
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.bridge import Bridge
from hardware_bridge.live.group import LiveGroup
from hardware_bridge.live.replay import open_replay
from hardware_bridge.live.swarm import GONE, LiveSwarm
from hardware_bridge.live.warm_up import warm_up
from hardware_bridge.readings import MICROSECONDS_64, PoseReading, Source
from relpos_env import formation_v0
from relpos_env.interface.observations import observation_mode
from relpos_env.interface.observations.base import total_size

NOW = time.monotonic_ns
S = 1_000_000_000


def config_text(port, n=2, source='source = "positions"', rest=""):
    nodes = "\n".join(f"[nodes.{k + 1}]" for k in range(n))
    return f"""
{nodes}
[links.mocap]
port = "{port}"
format = "positions"
{rest}
[tracker]
{source}
"""


def parsed(text):
    return parse_config(text, file="swarm.toml", folder=Path("/there"))


def line(**said):
    return (json.dumps(said) + "\n").encode()


class PortFeed:
    """Feed that reads ports until data arrives."""

    def __init__(self, swarm, links, say):
        self.swarm, self.links, self.say = swarm, links, say

    def advance(self):
        self.say()
        end = NOW() + 10 * S
        while not (chunks := self.links.wait(0.05)):
            assert NOW() < end, "nothing came"
        for chunk in chunks:
            self.swarm.take(chunk)
        return NOW()

    def decide(self, picture):
        assert np.isfinite(picture.pos).all()


def drive(config, say):
    """Return the swarm and the observations of two cars at rest after some lines."""
    with Links([link.port for link in config.links], NOW) as links:
        swarm = LiveSwarm(config, NOW())
        group = LiveGroup(swarm, PortFeed(swarm, links, say), observation_mode("estimate", 2))
        group.begin()
        for _ in range(8):
            group.step(np.zeros((1, 2)), np.zeros((1, 2)))
        return swarm, group.observations[0].copy()


def lines_now():
    t = NOW() // 1000
    return (
        line(time=t, node=1, pos=[1.0, 1.0], yaw=0.0, speed=0.15)
        + line(time=t, node=2, pos=[3.0, 2.0], yaw=np.pi / 2)
        + line(time=t, node=99, pos=[0.0, 0.0])
    )


def check_standing(swarm, observations):
    assert observations[0, :3] == pytest.approx((1.0, 2.0, 1.0), abs=1e-3)
    assert observations[1, :3] == pytest.approx((1.0, -1.0, 2.0), abs=1e-3)
    assert swarm.view.speed[0, 0] == 0.15
    assert swarm.view.heading[0] == pytest.approx((0.0, np.pi / 2))
    texts = [text for _, text in swarm.intake.notices]
    assert texts == ["links.mocap: device 99 is no node of the configuration; name it in its ids"]


def test_over_a_pty(tmp_path):
    device = FakeDevice(tmp_path / "mocap")
    try:
        config = parsed(config_text(device.path))
        check_standing(*drive(config, lambda: device.say(lines_now())))
    finally:
        device.unplug()


def test_over_a_file_beside_the_configuration(tmp_path):
    (tmp_path / "swarm.toml").write_text(config_text("file:mocap.jsonl"))
    with (tmp_path / "mocap.jsonl").open("wb") as file:

        def say():
            file.write(lines_now())
            file.flush()

        check_standing(*drive(read_config(tmp_path / "swarm.toml"), say))


def test_a_recording_gives_the_same(tmp_path):
    """Views at the same times are equal to the last bit."""
    config, run, seen = tmp_path / "swarm.toml", tmp_path / "run.rec", {}
    config.write_text(config_text("file:mocap.jsonl"))
    with (tmp_path / "mocap.jsonl").open("wb") as file:  # noqa: SIM117
        with Bridge(read_config(config), record=run) as bridge:
            group = LiveGroup(bridge.swarm, bridge.feed, observation_mode("estimate", 2))
            group.begin()
            for k in range(4):
                file.write(lines_now() + line(i=2, j=1, pos=[k, 1.5], vel=[0, 1], nlos=0.5))
                file.flush()
                group.step(np.zeros((1, 2)), np.zeros((1, 2)))
                seen[group.t_ns] = [array.copy() for array in bridge.swarm.view]
    assert bridge.swarm.view.ok[0, 0, 1]
    feed = open_replay(run)
    n_same = 0
    while (t_ns := feed.advance()) is not None:
        feed.swarm.step(t_ns)
        if t_ns in seen:
            told = zip(feed.swarm.view._fields, feed.swarm.view, seen[t_ns], strict=True)
            tasks = ("target", "has_target", "command")
            assert all((a == b).all() for name, a, b in told if name not in tasks)
            n_same += 1
    assert n_same == 4


def test_it_sees_what_the_simulator_shows():
    """True states sent as lines give the observations of the mode `truth`."""
    env = formation_v0.parallel_env(n_cars=3, scenario="ring-los", observation="truth")
    observations, _ = env.reset(seed=3)
    rng = np.random.default_rng(1)
    swarm = LiveSwarm(parsed(config_text("tcp:mocap:4000", n=3)), 0)
    encoder = make_encoder("positions", "mocap")
    mode = observation_mode("estimate", 3)
    out = np.zeros((1, 3, total_size(mode.fields)), np.float32)
    for k in range(1, 30):
        actions = {a: rng.uniform(-1, 1, 2).astype(np.float32) for a in env.agents}
        observations, *_ = env.step(actions)
        s, view = env.formation.state, env.loop.view
        t_ns = k * S // 10
        source = Source(ticks=t_ns // 1000, clock=MICROSECONDS_64)
        poses = [
            PoseReading(
                source,
                str(node + 1),
                pos=(*s.pos_w[0, node].tolist(), 0.0),
                vel=(*s.vel_w[0, node].tolist(), 0.0),
                q_wb=(np.cos(s.heading[0, node] / 2), 0.0, 0.0, np.sin(s.heading[0, node] / 2)),
                speed=float(view.speed[0, node]),
            )
            for node in range(3)
        ]
        swarm.take(Chunk("links.mocap", t_ns, encoder.encode(poses)))
        ones = np.ones(len(view.speed[0]))
        swarm.apply(view.speed[0], view.steering[0], ones, -ones)
        swarm.share(view.target, view.has_target, view.command)
        swarm.step(t_ns)
        mode.bind(swarm.view, out)()
        expected = np.stack([observations[a] for a in env.agents])
        assert out[0] == pytest.approx(expected, rel=1e-6, abs=2e-6)
    assert out[0, :, :2].all()


def test_who_falls_silent_is_lost_and_then_gone():
    swarm = LiveSwarm(parsed(config_text("tcp:mocap:4000")), 0)
    said = line(i=1, j=2, pos=[1, 0]) + line(node=1, yaw=0) + line(node=2, yaw=0)
    swarm.take(Chunk("links.mocap", S, said))
    seen = []
    for seconds in (1.0, 2.0, 1.1 + GONE):
        swarm.step(round(seconds * S))
        seen.append((int(swarm.view.status[0, 0, 1]), bool(swarm.view.present[0, 0])))
    assert seen == [(3, True), (4, True), (0, False)]


def test_a_jump_is_believed_once_it_is_told_again():
    swarm = LiveSwarm(parsed(config_text("tcp:mocap:4000")), 0)
    for k, x in enumerate((1.0, 1.0, 90.0, 1.0, 90.0, 90.1, 90.2)):
        pair = line(i=1, j=2, pos=[x, 0], vel=[0, 0]) + line(i=2, j=1, pos=[-x, 0], vel=[0, 0])
        swarm.take(Chunk("links.mocap", S + k * S // 50, pair[: pair.index(b"\n") + 1]))
        swarm.step(S + k * S // 50)
        expected = 90.2 if k == 6 else 1.0
        assert swarm.view.pos[0, 0, 1, 0] == expected
    assert swarm.intake.plausibility.refused["jump"] == 3


def test_either_end_may_be_named_first():
    swarm = LiveSwarm(parsed(config_text("tcp:mocap:4000")), 0)
    for k, (i, j, x) in enumerate(((1, 2, 5.0), (2, 1, -5.0), (1, 2, 5.0))):
        swarm.take(Chunk("links.mocap", S + k, line(i=i, j=j, pos=[x, 0], vel=[0, 0])))
        swarm.step(S + k)
        assert swarm.view.pos[0, 0, 1, 0] == 5.0


def test_names_of_the_other_tracker_become_nodes():
    rest = 'ids = { "rigid body a" = 1, "b" = 2 }'
    swarm = LiveSwarm(parsed(config_text("tcp:mocap:4000", rest=rest)), 0)
    swarm.take(Chunk("links.mocap", S, line(i="Rigid body A", j="B", pos=[1, 2], vel=[0, 0])))
    swarm.step(S)
    assert swarm.view.pos[0, 0, 1].tolist() == [1.0, 2.0]


def test_positions_are_asked_for_where_they_come():
    with pytest.raises(BridgeError, match=r'tracker.source: a link has format = "positions"'):
        parsed(config_text("tcp:mocap:4000", source=""))
    text = config_text("tcp:mocap:4000").replace('format = "positions"', 'format = "linktrack"')
    with pytest.raises(BridgeError, match=r'tracker.source: "positions" needs a link'):
        parsed(text)
    with pytest.raises(BridgeError, match=r"tracker.source: expected one of 'measurements'"):
        parsed(config_text("tcp:mocap:4000", source='source = "mocap"'))
    with pytest.raises(BridgeError, match=r"tracker.positions.std: expected a number above 0"):
        parsed(config_text("tcp:mocap:4000") + "[tracker.positions]\nstd = 0\n")
    assert parsed(config_text("file:p")).links[0].port.port == "file:/there/p"
    assert parsed(config_text("file:/p")).links[0].port.port == "file:/p"


def test_all_is_loaded_before_a_drive():
    warm_up(parsed(config_text("tcp:mocap:4000", n=3)))


def test_a_recording_stays_whatever_goes_wrong_at_the_end(tmp_path, monkeypatch):
    """The error is like a second Ctrl-C during shutdown."""
    config, run = tmp_path / "swarm.toml", tmp_path / "run.rec"
    config.write_text(config_text("file:mocap.jsonl"))
    (tmp_path / "mocap.jsonl").write_bytes(lines_now())
    bridge = Bridge(read_config(config), record=run)

    def interrupted():
        raise KeyboardInterrupt

    bridge._stack.callback(interrupted)
    bridge.feed.advance()
    with pytest.raises(KeyboardInterrupt):
        bridge.close()
    assert run.stat().st_size > 0


def test_a_line_may_hold_more_than_is_read():
    swarm = LiveSwarm(parsed(config_text("tcp:mocap:4000")), 0)
    more = line(node=1, pos=[1.0, 2.0, 3.0], header={"seq": 4})
    torn = b'{"node": 2, "pos": [1.0, ' + line(node=2, pos=[4.0, 5.0, 6.0])
    swarm.take(Chunk("links.mocap", S, more + torn))
    assert sorted(swarm.intake.received_ns) == [0, 1]
