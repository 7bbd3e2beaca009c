"""People in motion: trackers on the skin, limbs in the way of the radio.

`motion` turns samples into a smooth motion; they come from `procedural` (a skeleton that does
the exercises of `exercises`) or from `recorded` (motion capture).
"""
