"""The paper's figures: ``compute`` does the science, ``draw`` only draws.

Internal: the public names are those of ``vibrissa`` itself.
"""
