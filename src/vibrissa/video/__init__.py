"""Movies: reading, rendering and tracking of whiskers.

Internal: the public names are those of ``vibrissa`` itself.
"""
