"""Runs of every form of the environment under random commands, and all bits of their results."""

from dataclasses import replace

import numpy as np

from relpos_env.formation_v0 import parallel_env
from relpos_env.scenarios import SCENARIOS, draw_episode
from relpos_env.scenarios.randomisation import Randomisation
from relpos_env.world.world import World


def busy(n_cars=5, rate=60.0):
    """Return the hardest level, with joins, leaves and power losses within seconds."""
    scenario = SCENARIOS["random"].at_level(4).with_cars(n_cars)
    life = {"n_cars": (n_cars - 1, n_cars), "leave_rate": (rate, rate), "absence": (0.2, 4.0)}
    power = {"power_off_rate": (rate, rate), "power_off_time": (0.2, 0.8)}
    return replace(scenario, randomisation=replace(scenario.randomisation, **life, **power))


def bits(value):
    """Return all values of nested results, comparable bit for bit."""
    if isinstance(value, dict):
        return {key: bits(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple) or np.asarray(value).dtype.hasobject and value is not None:
        return [bits(inner) for inner in value]
    if value is None:
        return None
    array = np.asarray(value)
    return array.dtype.str, array.shape, array.tobytes()


def commands(space, rng, shape=(), scale=1.0):
    """Return random actions of a space, (*shape, *action)."""
    if hasattr(space, "nvec"):
        return rng.integers(space.nvec, size=(*shape, *space.shape))
    if hasattr(space, "n"):
        return rng.integers(space.n, size=shape)
    return rng.uniform(-scale, scale, (*shape, *space.shape)).astype(np.float32)


def parallel_run(env, seed, episodes=3, scale=1.0):
    """Return all results of whole episodes of the PettingZoo form."""
    rng, trace = np.random.default_rng(7), []
    for k in range(episodes):
        trace.append(bits((*env.reset(seed=None if k else seed), env.state())))
        while env.agents:
            actions = {a: commands(env.action_space(a), rng, scale=scale) for a in env.agents}
            trace.append(bits((*env.step(actions), env.agents, env.state())))
    return trace


def gym_run(env, seed, episodes=3):
    """Return all results of whole episodes of the Gymnasium form."""
    rng, trace = np.random.default_rng(7), []
    for k in range(episodes):
        trace.append(bits(env.reset(seed=None if k else seed)))
        over = False
        while not over:
            step = env.step(commands(env.action_space, rng))
            over = step[2] or step[3]
            trace.append(bits(step))
    return trace


def vector_run(env, seed, steps):
    """Return all results of some steps of the vector form, with the actions."""
    rng, trace = np.random.default_rng(7), [env.reset(seed=seed)]
    space = env.single_action_space
    taken = [commands(space, rng, (env.num_envs,)) for _ in range(steps)]
    trace += [env.step(actions) for actions in taken]
    return trace, taken


def slots_run(env, seed, steps):
    """Return all results of some steps of the Stable-Baselines3 form, with the actions."""
    env.seed(seed)
    rng, trace = np.random.default_rng(7), [env.reset()]
    taken = [commands(env.action_space, rng, (env.num_envs,)) for _ in range(steps)]
    trace += [env.step(actions) for actions in taken]
    return trace, taken


def run_of_seed(seed):
    """Return a run in an environment of its own, for other processes."""
    return parallel_run(parallel_env(max_cycles=10), seed, episodes=2)


def placed(start, *, room=(8.0, 8.0), obstacles=(), base="cars-los"):
    """Return a simulator of one group with given cars and boxes, without randomisation."""
    start = np.array(start, dtype=np.float64)
    n = len(start)
    place = replace(SCENARIOS[base], obstacles=(), n_cars=2, name="placed")
    drawn = draw_episode(place, n, 100.0, np.random.default_rng(0))
    # There must be room for all given boxes.
    wide = replace(
        place, room=room, ring=(0.3, 0.3), layout="scattered",
        randomisation=Randomisation(obstacles=(0, len(obstacles))),
    )  # fmt: skip
    swarm = World(wide, n)
    episode = replace(
        drawn, start=start, present=np.ones(n, dtype=bool), obstacles=tuple(obstacles)
    )
    swarm.begin(0, episode, np.random.default_rng(1))
    return swarm


def drive(swarm, seconds, speed, steering=0.0):
    """Apply one command for a while; return the contacts that every car began, (car)."""
    shape = swarm.contacts.shape
    contacts = np.zeros(shape[1])
    for _ in range(round(seconds * 10)):
        swarm.step(
            np.broadcast_to(np.asarray(speed, float), shape).copy(),
            np.broadcast_to(np.asarray(steering, float), shape).copy(),
        )
        contacts += swarm.contacts[0]
    return contacts
