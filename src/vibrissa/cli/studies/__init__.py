"""Verbs of whole studies: run, checked, drawn and exported; the interactive page; what a file, a machine is."""

from vibrissa.cli.studies.explore import explore
from vibrissa.cli.studies.export import export
from vibrissa.cli.studies.figure import figure
from vibrissa.cli.studies.info import info
from vibrissa.cli.studies.run import recordings, run
from vibrissa.cli.studies.show import show
from vibrissa.cli.studies.study import study

GROUP = "Studies"
VERBS = (run, recordings, study, figure, show, export, explore, info)
