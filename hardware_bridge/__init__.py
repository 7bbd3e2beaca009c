"""Streams of real nodes into the tracker, and policies onto real cars.

Empty in this version: the place is kept, with its borders, for links, decoders and drivers.
"""
