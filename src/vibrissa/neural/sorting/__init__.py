"""Spike sorting of raw recordings, and the quality of sorted units.

`sorters` runs a sorter, `simulated` makes recordings of known truth, `quality` measures units.
"""
