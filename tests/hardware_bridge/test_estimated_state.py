"""Estimated positions of cars: as tracked, and by odometry while tracking is uncertain."""

import numpy as np
import pytest

from hardware_bridge.live.estimated_state import EstimatedState
from relpos_env.interface.views import make_view

DT, RADIUS, RATE = 0.1, 1.5, 0.8
START = np.array([0.0, 2.1, 4.2, 5.3])


def seen_at(view, t, ok):
    """Set cars on one circle, as seen by an exact tracker; return their centred positions."""
    n = len(ok)
    phase = START[:n] + RATE * t
    pos = RADIUS * np.stack([np.cos(phase), np.sin(phase)], axis=-1)
    view.present[0] = view.oriented[0] = True
    view.ok[0] = ok[:, None] & ok & ~np.eye(n, dtype=bool)
    view.pos[0] = np.where(view.ok[0][..., None], pos[None] - pos[:, None], 0.0)
    view.heading[0] = phase + 0.5 * np.pi
    view.speed[0] = RADIUS * RATE
    return pos - pos.mean(axis=0)


@pytest.mark.parametrize("lost", range(3))
def test_a_car_of_which_nobody_is_sure_goes_on_by_its_odometer(lost):
    estimated, view = EstimatedState(3), make_view(1, 3)
    doubtful = np.arange(3) != lost
    for k in range(60):
        sure = not 20 <= k < 40
        true = seen_at(view, k * DT, np.ones(3, dtype=bool) if sure else doubtful)
        estimated.update(view, DT)
        assert estimated.complete == sure
        np.testing.assert_allclose(estimated.pos_w[0], true, atol=1e-12 if sure else 0.02)
        np.testing.assert_allclose(np.hypot(*estimated.vel_w[0].T), RADIUS * RATE)


def test_a_car_that_was_never_seen_has_no_place():
    estimated, view = EstimatedState(3), make_view(1, 3)
    for k in range(5):
        seen_at(view, k * DT, np.array([True, True, False]))
        estimated.update(view, DT)
        assert not estimated.complete
        assert estimated.known[0].tolist() == [True, True, False]
        np.testing.assert_array_equal(estimated.pos_w[0, 2], 0.0)
        np.testing.assert_allclose(estimated.pos_w[0, :2].sum(axis=0), 0.0, atol=1e-12)


def test_a_car_that_left_and_came_back_has_none_until_it_is_seen():
    estimated, view = EstimatedState(3), make_view(1, 3)
    seen_at(view, 0.0, np.ones(3, dtype=bool))
    estimated.update(view, DT)
    seen_at(view, DT, np.array([True, True, False]))
    view.present[0, 2] = False
    estimated.update(view, DT)
    assert estimated.present[0].tolist() == [True, True, False]
    assert estimated.complete
    seen_at(view, 2 * DT, np.array([True, True, False]))
    estimated.update(view, DT)
    np.testing.assert_array_equal(estimated.pos_w[0, 2], 0.0)
    assert not estimated.complete


def test_a_place_that_goes_on_outlasts_who_comes_back():
    estimated, view = EstimatedState(4), make_view(1, 4)
    of_three = np.array([True, True, True, False])
    for k in range(40):
        # Car 3 is never tracked again; then car 0 is away for a while.
        ok = np.ones(4, dtype=bool) if k < 10 else of_three.copy()
        ok[0] = not 15 <= k < 20
        true = seen_at(view, k * DT, ok)
        view.present[0, 0] = ok[0]
        estimated.update(view, DT)
        here = view.present[0]
        np.testing.assert_allclose(
            estimated.pos_w[0, here], true[here] - true[here].mean(axis=0), atol=0.02
        )
