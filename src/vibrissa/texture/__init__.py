"""Textures: what the whisker is dragged over."""
