"""Neurons: simulated units, responses, and whether the envelope drives them.

Internal: the public names are those of ``vibrissa`` itself.
"""
