"""Colours of cars, suitable for colour-blind readers, and of all other parts.

The first six car colours are from Okabe and Ito [1] without black and yellow, which have little
contrast to outlines and to a light floor; the others are darker tones from Tol [2]. With more cars
the colours repeat; every car also has its number.

References:
    [1] Okabe, Ito, Color Universal Design, 2008, https://jfly.uni-koeln.de/color/
    [2] Tol, Colour Schemes, SRON/EPS/TN/09-002, 2021.
"""

from __future__ import annotations

Colour = tuple[int, int, int]

CARS: tuple[Colour, ...] = (
    (0, 114, 178),  # blue
    (213, 94, 0),  # vermillion
    (0, 158, 115),  # bluish green
    (204, 121, 167),  # reddish purple
    (230, 159, 0),  # orange
    (86, 180, 233),  # sky blue
    (51, 34, 136),  # indigo
    (136, 34, 85),  # wine
    (153, 153, 51),  # olive
    (17, 119, 51),  # green
)

PAGE: Colour = (244, 245, 247)
CARD: Colour = (255, 255, 255)
CARD_EDGE: Colour = (221, 224, 229)
FLOOR: Colour = (255, 255, 255)
GRID: Colour = (230, 233, 237)
WALL: Colour = (84, 90, 100)
INK: Colour = (38, 43, 51)
FAINT_INK: Colour = (108, 116, 128)
SHADOW: Colour = (20, 26, 38)
BOX: Colour = (196, 201, 208)
BOX_HATCH: Colour = (164, 171, 181)
BOX_EDGE: Colour = (92, 99, 110)
CRATE: Colour = (236, 213, 174)
CRATE_PLANK: Colour = (201, 168, 116)
CRATE_EDGE: Colour = (140, 106, 54)
TYRE: Colour = (42, 45, 50)
GLASS: Colour = (36, 48, 62)
LIGHT: Colour = (255, 244, 200)
NO_POWER: Colour = (160, 165, 172)
CROSSED: Colour = (200, 40, 40)
SIGHT: Colour = (98, 158, 124)
NO_SIGHT: Colour = (236, 140, 20)
SILENT: Colour = (214, 60, 60)
TARGET: Colour = (224, 228, 238)
PLAN: Colour = (150, 130, 190)
FORMATION_ERROR: Colour = (58, 66, 92)
TRACKING_ERROR: Colour = (214, 72, 60)


def car_colour(car: int) -> Colour:
    """Return the colour of a car and of its estimate."""
    return CARS[car % len(CARS)]


def mix(colour: Colour, other: Colour, share: float) -> Colour:
    """Return a mix of two colours; `share` of the other colour in [0, 1]."""
    r, g, b = (round((1.0 - share) * p + share * q) for p, q in zip(colour, other, strict=True))
    return r, g, b
