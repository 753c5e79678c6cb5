"""Figures beside the paper's: scans, previews, robustness, whatever a dataset holds.

In every file `compute` does the science and `draw` only draws.
"""
