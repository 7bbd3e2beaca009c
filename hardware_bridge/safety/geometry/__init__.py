"""Geometry for the rules of the gate: stopping distances, turning circles, polygons."""
