"""Parts of the paper's figures that fill a file of their own: a panel, a caption, a computation.

Each is used by the figure whose number it bears.
"""
