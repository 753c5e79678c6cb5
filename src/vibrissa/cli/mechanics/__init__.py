"""Verbs of one whisker: its geometry, modes and profile, textures drawn past it, the signal at its base."""

from vibrissa.cli.mechanics.gap import gap
from vibrissa.cli.mechanics.geometry import atlas, whisker
from vibrissa.cli.mechanics.map import map_
from vibrissa.cli.mechanics.modes import modes
from vibrissa.cli.mechanics.profile import profile
from vibrissa.cli.mechanics.scan import scan
from vibrissa.cli.mechanics.sensor import sensor
from vibrissa.cli.mechanics.whisking import whisking

GROUP = "Whisker and mechanics"
VERBS = (whisker, atlas, modes, profile, gap, scan, whisking, map_, sensor)
