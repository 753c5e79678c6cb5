"""Make the nine figures of the gallery from the built-in experiment.

python docs/make_gallery.py [FOLDER]

By the same calls as ``vibrissa run`` and ``vibrissa figure``.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from vibrissa.study.gallery import figure_of, numbers
from vibrissa.study.settings import read_study
from vibrissa.study.study import run_study


def figures():
    """Give number and figure, one after the other."""
    with TemporaryDirectory() as folder:
        run_study(read_study(), Path(folder) / "out")
        for number in numbers():
            yield number, figure_of(number, Path(folder) / "out")


def make(folder):
    """Write the figures that a folder does not hold yet."""
    folder = Path(folder)
    if (folder / "fig9.png").exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    for number, figure in figures():
        figure.savefig(folder / f"fig{number}.png", metadata={"Software": None})


if __name__ == "__main__":
    make(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "_build/gallery")
