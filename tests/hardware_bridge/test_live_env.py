"""The environment on cars is that of the simulator: spaces, loops, wrappers; in virtual time."""

import numpy as np
import pytest
from pettingzoo.test import api_test, parallel_api_test
from pettingzoo.utils import OrderEnforcingWrapper
from pettingzoo.utils.conversions import aec_to_parallel, parallel_to_aec
from pettingzoo.utils.wrappers import BaseParallelWrapper

from agents.controllers import Consensus
from agents.hardware.emulate import EmulateOptions
from agents.hardware.emulate.virtual import LAG, START_NS, VirtualBridge
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.env import HardwareFormationEnv
from hardware_bridge.live.replay import APPLIED, ReplayFeed
from hardware_bridge.live.start import StartParams, is_home, wriggle
from hardware_bridge.recording import Header, Recorder, read_recording
from hardware_bridge.recording import Kind as Record
from relpos_env import formation_v0
from relpos_env.errors import EnvError
from relpos_env.interface.actions import ACTIONS
from relpos_env.interface.base_parallel_env import BaseFormationParallelEnv
from relpos_env.interface.observations import OBSERVATIONS

OPTIONS = EmulateOptions(scenario="cars-nlos", seed=3, seconds=600.0)
SIMULATOR = {"scenario": "cars-nlos"}
MODES = [name for name in OBSERVATIONS if name != "truth"]


@pytest.fixture
def bridge():
    """Yield cars that are never armed: a reset takes no time, and no command moves them."""
    with_nobody = VirtualBridge(OPTIONS, arm=False)
    yield with_nobody
    with_nobody.close()


@pytest.fixture(scope="module")
def armed():
    """Yield cars that are armed and localised."""
    started = VirtualBridge(OPTIONS)
    started.env().reset()
    yield started
    started.close()


def drive(env, act, seed=7):
    """Run a common policy loop; return observations, rewards and the last infos."""
    seen, rewards = [], []
    observations, infos = env.reset(seed=seed)
    while env.agents:
        actions = {agent: act(env, agent, observations[agent]) for agent in env.agents}
        observations, reward, terminated, truncated, infos = env.step(actions)
        seen.append(observations)
        rewards.append(reward)
        assert set(terminated) == set(truncated) == set(observations) == set(infos)
    return seen, rewards, infos


@pytest.mark.parametrize("history", [1, 3])
@pytest.mark.parametrize("mode", MODES)
def test_spaces_are_those_of_the_simulator(bridge, mode, history):
    ours = bridge.env(observation=mode, history=history)
    theirs = formation_v0.parallel_env(**SIMULATOR, observation=mode, history=history)
    assert isinstance(ours, BaseFormationParallelEnv)
    assert isinstance(theirs, BaseFormationParallelEnv)
    assert ours.possible_agents == theirs.possible_agents
    assert ours.observation_spaces == theirs.observation_spaces
    assert ours.action_spaces == theirs.action_spaces
    assert ours.fields == theirs.fields
    assert ours.metadata["name"] == theirs.metadata["name"] == "formation_v0"


@pytest.mark.parametrize("actions", ACTIONS)
def test_actions_are_those_of_the_simulator(bridge, actions):
    ours = bridge.env(actions=actions)
    theirs = formation_v0.parallel_env(**SIMULATOR, actions=actions)
    assert ours.action_spaces == theirs.action_spaces
    ours.reset()
    with pytest.raises(EnvError, match="action of car_1: expected shape"):
        ours.step({**{a: s.sample() for a, s in ours.action_spaces.items()}, "car_1": [0.0] * 3})


def test_truth_is_refused(bridge):
    with pytest.raises(BridgeError, match="real cars know no truth"):
        bridge.env(observation="truth")


@pytest.mark.parametrize("history", [1, 2])
@pytest.mark.parametrize("mode", MODES)
def test_observations_are_inside_their_spaces(bridge, mode, history):
    env = bridge.env(observation=mode, history=history, max_cycles=20)

    def sample(env, agent, observation):
        assert env.observation_space(agent).contains(observation)
        return env.action_space(agent).sample()

    seen, _, infos = drive(env, sample)
    assert len(seen) == 20
    for observations in seen:
        for agent, observation in observations.items():
            assert env.observation_space(agent).contains(observation)
    for info in infos.values():
        assert "collisions" not in info
        assert info["tracking_error"] == np.inf
        assert info["allowed_speed"] <= abs(info["asked_speed"]) + 1e-9
        assert (info["gate"] != "") or not info["stopped"]
    assert env.metadata["render_modes"] == []


@pytest.mark.filterwarnings("ignore:Observation numpy array is all zeros:UserWarning")
def test_the_checkers_of_pettingzoo_pass(bridge):
    parallel_api_test(bridge.env(max_cycles=12), num_cycles=30)
    api_test(OrderEnforcingWrapper(parallel_to_aec(bridge.env(max_cycles=8))), num_cycles=40)


class Slower(BaseParallelWrapper):
    """A wrapper as written for the simulator: scaled actions, and rewards in tenths."""

    def step(self, actions):
        gentler = {agent: np.float32([0.9, 1.0]) * action for agent, action in actions.items()}
        observations, rewards, *rest = super().step(gentler)
        return observations, {agent: 0.1 * r for agent, r in rewards.items()}, *rest


def wrapped(env):
    """Wrap the environment and convert it to AEC and back."""
    return aec_to_parallel(parallel_to_aec(Slower(env)))


def consensus(env, agent, observation):
    return Consensus(env.unwrapped.fields).act(observation)


@pytest.mark.parametrize("wrap", [lambda env: env, Slower, wrapped], ids=["bare", "own", "turns"])
def test_a_loop_with_wrappers_runs_on_both(armed, wrap):
    """The same code drives simulated and emulated cars into formation."""
    live = armed.env(max_cycles=60)
    simulated = formation_v0.parallel_env(**SIMULATOR, max_cycles=60)
    fields = simulated.fields
    driver = Consensus(fields)
    for env in (simulated, live):
        seen, rewards, infos = drive(wrap(env), lambda env, agent, seen: driver.act(seen))
        assert len(seen) == len(rewards) == 60
        assert sum(info["formation_error"] for info in infos.values()) < 3 * 0.4


def test_a_reset_arms_and_lets_cars_find_each_other():
    bridge = VirtualBridge(OPTIONS)
    env = bridge.env(max_cycles=5)
    env.reset()
    assert [text for _, text in bridge.feed.notices] == ["arm"]
    assert env.group.estimated.complete
    assert bridge.feed.report.armed.all()
    t_ns = bridge.feed.t_ns
    assert t_ns > START_NS
    drive(env, consensus)
    # The cars are already armed and localised, so the next episode begins soon.
    assert bridge.feed.t_ns - t_ns < 10_000_000_000
    assert [text for _, text in bridge.feed.notices] == ["arm"]
    env.close()
    assert env.agents == []
    with pytest.raises(EnvError, match="must be reset first"):
        env.step({})
    bridge.close()


@pytest.mark.parametrize("person", [False, True])
def test_only_the_first_start_arms_by_itself(person):
    bridge = VirtualBridge(OPTIONS, wait=3.0)
    env = bridge.env(max_cycles=5)
    env.reset()
    bridge.feed.order("disarm")
    while env.agents:
        env.step({agent: np.zeros(2, np.float32) for agent in env.agents})
    decisions = iter(range(1, 1000))

    def attend():
        if person and next(decisions) == 5:
            bridge.feed.order("arm")
        return False

    bridge.start.attend = attend
    if person:
        env.reset()
        assert bridge.feed.report.armed.all()
    else:
        with pytest.raises(BridgeError, match="only a person arms them again"):
            env.reset()
        assert not bridge.feed.report.armed.any()
    assert "stopped cars wait to be armed by a person" in [text for _, text in bridge.feed.notices]
    bridge.close()


@pytest.mark.parametrize(("pressed", "moves"), [
    ({1: "stop", 2: "clear"}, False), ({1: "disarm"}, False), ({1: "disarm", 2: "arm"}, True),
])  # fmt: skip
def test_whoever_stops_the_cars_while_they_wait_arms_them_too(pressed, moves):
    bridge = VirtualBridge(OPTIONS, wait=2.0)
    decisions = iter(range(1, 1000))

    def attend():
        what = pressed.get(next(decisions))
        if what is not None:
            bridge.start.heed(what)
            bridge.feed.order(what)
        return False

    bridge.start.attend = attend
    env = bridge.env()
    if moves:
        env.reset()
        assert bridge.feed.report.armed.all()
    else:
        with pytest.raises(BridgeError, match="not armed within 2 s, since a key"):
            env.reset()
        assert not bridge.feed.report.armed.any()
    bridge.close()


def test_a_virtual_drive_is_the_same_every_time():
    def once():
        bridge = VirtualBridge(OPTIONS)
        env = HardwareFormationEnv(bridge.swarm, bridge.feed, max_cycles=40)
        seen, rewards = [], []
        observations, _ = env.reset()
        while env.agents:
            if len(seen) == 22:
                bridge.feed.order("arm")
            seen.append(list(observations.values()))
            observations, reward, *_ = env.step(
                {a: consensus(env, a, o) for a, o in observations.items()}
            )
            rewards.append(reward)
        assert bridge.feed.report.lag == pytest.approx(LAG)
        assert np.abs(bridge.swarm.view.speed).max() > 0.1
        bridge.close()
        return seen, rewards

    (one, first), (other, second) = once(), once()
    np.testing.assert_array_equal(one, other)
    assert first == second


def test_commands_pass_the_gate(armed):
    """Commands beyond the limits do not reach the cars, and a stop order stops them."""
    limit = armed.config.safety.max_speed
    env = armed.env()
    env.reset()
    for _ in range(5):
        env.step({agent: np.float32([1.0, 0.0]) for agent in env.agents})
        assert (np.abs(armed.feed.report.speed) <= limit + 1e-9).all()
    armed.feed.order("stop")
    moves = []
    for _ in range(30):
        env.step({agent: np.float32([1.0, 0.0]) for agent in env.agents})
        moves.append(np.array(armed.rig.world.motion()[0]))
    assert not armed.feed.report.armed.any()
    np.testing.assert_array_equal(armed.feed.report.speed, 0.0)
    # The odometer of a car at rest has noise of 0.02 m/s rms: use its mean over two seconds.
    assert np.abs(np.mean(moves[10:], axis=0)).max() < 0.03
    armed.feed.order("clear")
    armed.start.attend = lambda: armed.feed.order("arm")  # only the operator arms them again
    env.reset()
    armed.start.attend = None
    assert armed.feed.report.armed.all()


def test_unplugged_cars_are_known_to_be():
    bridge = VirtualBridge(OPTIONS)
    env = HardwareFormationEnv(bridge.swarm, bridge.feed)
    env.reset()
    assert bridge.feed.report.linked.tolist() == [1.0, 1.0, 1.0]
    bridge.rig.emulator.cars[0].line.unplug(1.0)
    env.step({agent: np.zeros(2, np.float32) for agent in env.agents})
    assert bridge.feed.report.linked.tolist() == [0.0, 1.0, 1.0]
    bridge.close()


def test_cars_that_wriggle_come_home():
    """Simulate bicycles without slip in steps of 1 ms."""
    p, n, dt, wheelbase = StartParams(), 5, 1e-3, 0.26
    pose, n_home = np.zeros((n, 3)), np.zeros(n)
    period = p.period * (1.0 + 0.2 * np.arange(n))
    for k in range(20_000):
        t = k * dt
        home = np.abs(t - np.round(t / period) * period) < 0.5 * dt
        assert is_home(p, n, t)[home].all()
        n_home += home
        assert np.abs(pose[home]).max(initial=0.0) < 5e-3
        assert np.abs(pose[:, :2]).max() < 0.5
        speed, steering = wriggle(p, n, t + 0.5 * dt)
        turn = speed[0] * np.tan(steering[0]) / wheelbase
        heading = pose[:, 2] + 0.5 * dt * turn
        pose += dt * np.stack(
            [speed[0] * np.cos(heading), speed[0] * np.sin(heading), turn], axis=-1
        )
    assert (n_home >= 6).all()


class Recorded:
    """A feed that records its data like the real one; cars are armed for a while."""

    def __init__(self, feed, recorder, names):
        self._feed, self._recorder, self._names, self._n = feed, recorder, names, 0

    def advance(self):
        self._n += 1
        if self._n in (15, 25):
            self._feed.order("arm" if self._n == 15 else "disarm")
        t_ns = self._feed.advance()
        report = self._feed.report
        if report is not None:
            told = {key: getattr(report, key).tolist() for key in APPLIED}
            self._recorder.add_event(t_ns, "applied", **told)
        self._recorder.add(Record.TICK, 0, t_ns)
        return t_ns

    def decide(self, picture):
        self._feed.decide(picture)


def test_a_replay_is_the_same_environment(tmp_path, monkeypatch):
    bridge = VirtualBridge(OPTIONS)
    swarm = bridge.swarm
    names = tuple(swarm.intake.streams)
    header = Header(
        software="test", config=bridge.config.text, links=names, monotonic_ns=START_NS, wall_ns=0
    )
    recorder = Recorder(tmp_path / "run.relpos", header)
    recorder.add_event(START_NS, "start")
    take = swarm.take

    def keep(chunk: Chunk) -> None:
        recorder.add(Record.BYTES_IN, names.index(chunk.link), chunk.t_ns, chunk.data)
        take(chunk)

    monkeypatch.setattr(swarm, "take", keep)
    live = HardwareFormationEnv(swarm, Recorded(bridge.feed, recorder, names), max_cycles=40)
    seen, rewards, _ = drive(live, consensus)
    recorder.close()
    bridge.close()
    feed = ReplayFeed(read_recording(tmp_path / "run.relpos"))
    again, same, _ = drive(HardwareFormationEnv(feed.swarm, feed, max_cycles=40), consensus)
    assert rewards == same
    assert swarm.view.speed.any()
    for one, other in zip(seen, again, strict=True):
        np.testing.assert_array_equal(list(one.values()), list(other.values()))
    # The end of a recording truncates the episode, and the environment passes the checker.
    feed = ReplayFeed(read_recording(tmp_path / "run.relpos"))
    parallel_api_test(HardwareFormationEnv(feed.swarm, feed, max_cycles=10), num_cycles=20)
