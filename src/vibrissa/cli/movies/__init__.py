"""Verbs of movies: points picked, whiskers tracked, corrected, measured, modes, posture, tracks of other programs."""

from vibrissa.cli.movies.correct import correct
from vibrissa.cli.movies.decompose import decompose
from vibrissa.cli.movies.import_tracks import import_tracks
from vibrissa.cli.movies.kinematics import kinematics
from vibrissa.cli.movies.pick import pick
from vibrissa.cli.movies.posture import posture
from vibrissa.cli.movies.track import track

GROUP = "Movies"
VERBS = (pick, track, import_tracks, correct, kinematics, decompose, posture)
