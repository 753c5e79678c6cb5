"""The pad: lines of all frames as arrays, where their bases are, how they turn together."""
