"""Coding of the stimulus in spikes: phase or envelope, drives, information, decoding, repeats needed.

Each file is one analysis; `demodulation`, `drive_choice`, `information`, `discrimination` and `planner` are verbs.
"""
