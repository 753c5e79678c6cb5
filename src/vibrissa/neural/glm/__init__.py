"""Poisson models of spiking: whiskers, latencies and the unit's own past.

`poisson_model` fits each unit, `surround` weighs every whisker, `delayed_envelopes` are their regressors.
"""
