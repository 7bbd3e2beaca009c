"""Streams of real nodes into the tracker, and policies onto real cars.

The links, decoders and drivers are not part of this version; `docs/roadmap.md` says what
comes. The package holds its place so that imports and tests keep to its borders.
"""
