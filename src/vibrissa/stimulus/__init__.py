"""The multiwhisker stimulator: commands that replay a texture's vibration, on 24 whiskers.

Internal: the public names are those of ``vibrissa`` itself.
"""
