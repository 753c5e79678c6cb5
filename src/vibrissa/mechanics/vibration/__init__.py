"""Vibration of the modes, exact from event to event (Eqs. 6 to 13).

`excitation` holds what drives the modes, `oscillator` the propagation, `dynamics` both together.
Other rooms use `dynamics`.
"""
