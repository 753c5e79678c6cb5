"""Whiskers followed from frame to frame: settings, background, seeds, the loop over blocks."""
