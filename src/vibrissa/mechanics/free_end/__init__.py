"""A fast model with the free end: which support the shaft has, event by event."""
