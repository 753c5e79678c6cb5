"""Neurons: simulated units, responses, and whether the envelope drives them."""
