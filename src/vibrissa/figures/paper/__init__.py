"""The paper's nine figures, by their numbers.

In every file `compute` does the science and `draw` only draws.
"""
