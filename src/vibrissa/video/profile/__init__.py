"""Profiles from centrelines: side of the base, nodes at fixed arc length, ends, tangent."""
