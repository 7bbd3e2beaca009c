"""People in motion: trackers on the skin, limbs that occlude the radio.

`motion` turns samples into a smooth motion; the samples come from `procedural` (a skeleton that
does the exercises of `exercises`) or from `recorded` (motion capture).
"""
