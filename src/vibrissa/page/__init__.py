"""The interactive page: one whisker on its texture, live, on this machine alone."""
