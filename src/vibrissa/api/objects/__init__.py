"""Objects of other packages, taken at the door and given back: spikes, trials, signals and tracks.

`spikes`, `trials`, `signals` and `tracks` take them, `back` gives them. No package is imported for an object
that is not its own.
"""
