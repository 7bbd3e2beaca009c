"""Constants of the kernels, derived once from the parameters and the constellation."""

from __future__ import annotations

import numpy as np

from tracking.arrays import Bool, whole_lines
from tracking.constellation import Constellation
from tracking.filters.joint.params import JointParams
from tracking.records import Records, coefficients


def make_coefficients(constellation: Constellation, params: JointParams) -> Records:
    """Return the constants of the kernels, (1); ``_var`` and ``2``: squared."""
    e, s = params.range_error, params.start
    v = params.nlos_in_space if constellation.dimensions == 3 else params.nlos
    gap_share = s.rotation_width_2d / s.rotations_2d
    rotation_std = s.rotation_std_3d if constellation.dimensions == 3 else gap_share
    has_states = has_range_errors(constellation, params)
    moving = [n for n in constellation.nodes if n.kind != "static"] or constellation.nodes
    white_var = e.white_std**2
    if not has_states:
        # Lasting errors count as white noise of the same weight over a second of driving.
        white_var += e.lasting_weight * (e.fast_std**2 + e.slow_std**2)
    values = {
        "white_var": white_var,
        "fast_var": e.fast_std**2,
        "slow_var": e.slow_std**2,
        "nlos_bias_var": v.nlos_bias_std**2,
        "nlos_bias_large_var": v.nlos_bias_large_std**2,
        "nlos_white_var": v.white_std**2 if has_states else v.repeats * v.nlos_bias_std**2,
        "height_var": s.height_std**2,
        "start_k": s.k,
        "start_max_age": s.max_age,
        "rotation_var": rotation_std**2,
        "position_var": s.position_std**2,
        "start_speed_var": s.speed_std**2,
        "unaided_psd2": params.unaided_accel_psd**2,
        "static_drift2": params.static_drift**2,
        "survey_var": params.survey_std**2,
        "rest_var": params.rest_std**2,
        "stale_var": params.stale_std**2,
        "propagation_period": min(params.vehicles[n.vehicle].propagation_period for n in moving),
    }
    parts = e, v, s, params, params.supervision, params.alignment, params.update
    n = count_rows(constellation, params)
    return coefficients(
        (*parts, params.noise_learning),
        values,
        d=constellation.dimensions,
        n=n,
        n_own=n,
        n_motion=count_motion(constellation),
    )


def count_states(constellation: Constellation, params: JointParams) -> int:
    """Return the number of states."""
    d = constellation.dimensions
    n = count_motion(constellation) + (d + 1) * int((~constellation.is_static).sum())
    for k in range(constellation.n_nodes):
        n += 6 * has_offset(constellation, params, k) + 2 * has_mount(constellation, params, k)
    if has_range_errors(constellation, params):
        n += 2 * int(moving_pairs(constellation).sum())
    return n


def count_rows(constellation: Constellation, params: JointParams) -> int:
    """Return the length of the arrays of states: the number of states, padded with unused ones.

    Compiled code processes up to eight numbers at a time, and the rest one by one.
    """
    return whole_lines(count_states(constellation, params))


def count_motion(constellation: Constellation) -> int:
    """Return the number of positions and velocities, the first states of the vector."""
    d = constellation.dimensions
    return sum(d if static else 2 * d for static in constellation.is_static)


def moving_pairs(constellation: Constellation) -> Bool:
    """True for pairs with a moving node, which are ranged, (pair)."""
    return np.asarray(~constellation.is_static[constellation.pairs].all(axis=1))


def has_offset(constellation: Constellation, params: JointParams, node: int) -> bool:
    """True if the accelerometer offset of a node has states: in space, with `offset_std`."""
    config = constellation.nodes[node]
    moves = config.kind != "static" and constellation.dimensions == 3
    return moves and params.vehicles[config.vehicle].offset_std is not None


def has_mount(constellation: Constellation, params: JointParams, node: int) -> bool:
    """True if the mount of a node has states: unknown, on wheels, group of up to `max_mounts`."""
    config = constellation.nodes[node]
    vehicle = params.vehicles[config.vehicle]
    slides = config.kind == "static" or vehicle.sideways_std is None
    _, ahead_std, _, slip_std = config.mount.prior(vehicle)
    is_small = constellation.n_nodes <= params.max_mounts
    return is_small and not slides and max(ahead_std, slip_std) > 0.0


def has_range_errors(constellation: Constellation, params: JointParams) -> bool:
    """True if range errors have states: in groups of up to `max_pairs` moving pairs."""
    return int(moving_pairs(constellation).sum()) <= params.range_error.max_pairs
