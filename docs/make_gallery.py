"""Make the nine figures of the gallery, small: one movie, twelve sweeps, a sixth of a population.

python docs/make_gallery.py [FOLDER]

All come from one study, by the same calls as ``vibrissa run`` and ``vibrissa figure``.
"""

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from vibrissa.study.cortex import Cortex
from vibrissa.study.gallery import figure_of, numbers
from vibrissa.study.gratings import Comparison
from vibrissa.study.laboratory import Laboratory
from vibrissa.study.settings import read_study
from vibrissa.study.study import run_study

SWEEPS = Laboratory(textures=1, n_frames=1200)  # two animals, three whiskers, two conditions
UNITS = Cortex(every=6, n_trials=40)


def figures():
    """Give number and figure, one after the other."""
    parts = {"laboratory": SWEEPS, "comparison": Comparison(gratings=19, jitter=0), "cortex": UNITS}
    with TemporaryDirectory() as folder:
        run_study(replace(read_study(), **parts), Path(folder) / "out")
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
