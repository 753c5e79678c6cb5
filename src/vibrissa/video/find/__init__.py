"""Whiskers found without seeds: all lines of every frame, and the whiskers of one image."""
