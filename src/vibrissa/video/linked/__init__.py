"""Whiskers of a movie whose lines are found in every frame and linked: marks, profile, and when this way is taken."""
