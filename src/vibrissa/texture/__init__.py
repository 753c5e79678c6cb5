"""Textures: what the whisker is dragged over.

Internal: the public names are those of ``vibrissa`` itself.
"""
