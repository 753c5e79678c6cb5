"""The whisker's mechanics: posture, gap, vibration, and back from motion to modes.

Internal: the public names are those of ``vibrissa`` itself.
"""
