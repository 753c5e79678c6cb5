"""The interactive page: one whisker on its texture, live, on this machine alone.

Internal: the public names are those of ``vibrissa`` itself.
"""
