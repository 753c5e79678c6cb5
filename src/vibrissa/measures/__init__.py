"""What is measured of whiskers in movies: angle, whisking cycle, bending, touches, from any profile.

Internal: the public names are those of ``vibrissa`` itself.
"""
