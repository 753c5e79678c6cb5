"""Frames in and out: containers, TIFF, Photron, folders, NumPy.

`movie` is the entry; nothing else of the package knows the codecs.
"""
