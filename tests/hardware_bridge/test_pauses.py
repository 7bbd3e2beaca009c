"""Existing objects are not scanned again; later garbage is still collected."""

import gc
import weakref

from hardware_bridge.pauses import short_pauses


class Knot:
    """Object that refers to itself: only a collection frees it."""

    def __init__(self):
        self.itself = self


def test_what_was_there_is_left_out_and_what_comes_is_collected():
    gc.unfreeze()
    with short_pauses():
        assert gc.get_freeze_count() > 10_000
        assert len(gc.get_objects()) < 10_000
        knot = Knot()
        gone = weakref.ref(knot)
        del knot
        gc.collect()
        assert gone() is None
    assert gc.get_freeze_count() == 0


def test_an_inner_one_leaves_the_outer_one_as_it_is():
    gc.unfreeze()
    with short_pauses():
        with short_pauses():
            pass
        assert gc.get_freeze_count() > 10_000
    assert gc.get_freeze_count() == 0
