"""Checks of a movie before it is tracked: trial light, levels that beat with key frames."""
