"""Envelope coupling: whether the envelope of the stimulus drives a unit.

Envelope and counts in the same bins, the test against circular shifts,
the threshold-linear fit with its intervals.
Other rooms use `analysis`, which does all of it for every unit.
"""
