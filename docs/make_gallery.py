"""Make the figures of the gallery from the built-in experiment.

python docs/make_gallery.py [FOLDER]

By the same calls as ``vibrissa run`` and ``vibrissa figure``.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from vibrissa.study.report.gallery import figure_of
from vibrissa.study.report.pages import write_picture
from vibrissa.study.run.study import run_study
from vibrissa.study.spec.settings import read_study
from vibrissa.study.stages.figure_table import figures_of
from vibrissa.study.stages.stages import expected


def figures():
    """Give number and figure, one after the other."""
    with TemporaryDirectory() as folder:
        study = read_study()
        run_study(study, Path(folder) / "out")
        for entry, _ in figures_of(study, expected(study)):
            yield entry.number, figure_of(entry.number, Path(folder) / "out")


def make(folder):
    """Write the figures into a folder, each with its caption in its metadata."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for number, figure in figures():
        write_picture(figure, folder / f"fig{number}.png")


if __name__ == "__main__":
    make(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "_build/gallery")
