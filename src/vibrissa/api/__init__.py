"""The public functions: one for each step of the two chains, in SI units, for scripts and notebooks.

They are imported as ``import vibrissa as vb``; ``vibrissa/__init__.pyi`` lists them. The command line calls the same.
"""
