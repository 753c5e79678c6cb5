"""Slow active whisking: a posture that changes while gaps pass.

The path of the posture, its table, the contact along it, oscillators whose frequency drifts.
Other rooms use `active_whisking`.
"""
