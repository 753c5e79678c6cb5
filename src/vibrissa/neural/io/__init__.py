"""Spikes, trials and stimuli in and out: CSV, NWB, Plexon, Phy, sorter folders, raw traces.

`recording` reads spikes of any format, `tables.inputs` joins them to a stimulus, `formats.nwb_writer` writes NWB.
"""
