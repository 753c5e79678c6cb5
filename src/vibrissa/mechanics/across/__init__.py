"""Statistics over many sweeps: collapse of resonances, prediction against measurement, gain.

Each file is one analysis over the table of sweeps.
"""
