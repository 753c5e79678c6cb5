"""Figures beside the paper's: scans, previews, coding.

In every file `compute` does the science and `draw` only draws.
"""
