"""Simulated units of known truth.

`virtual` draws spikes of one unit, `population` a population as the paper counts it, `driven` its responses.
"""
