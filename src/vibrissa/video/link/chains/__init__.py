"""Each whisker a chain over time: which line is whose, and where two have exchanged their names."""
