"""Make the nine figures of the gallery, small: one movie, twelve sweeps, a sixth of a population.

python docs/make_gallery.py [FOLDER]

Figures 1 to 8 come from one study, by the same calls as ``vibrissa run`` and ``vibrissa figure``; Figure 9 from every
sixth unit of a simulated population.
"""

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from make_cortex_figures import analysed, replayed

from vibrissa.figures import fig9
from vibrissa.neural.analysis import EnvelopeAnalysis
from vibrissa.neural.population import draw_population, record_population
from vibrissa.study.gallery import figure_of, numbers
from vibrissa.study.gratings import Comparison
from vibrissa.study.laboratory import Laboratory
from vibrissa.study.settings import read_study
from vibrissa.study.study import run_study

SWEEPS = Laboratory(textures=1, n_frames=1200)  # two animals, three whiskers, two conditions
EVERY, TRIALS = 6, 40


def figure_9():
    """A sixth of the units of docs/make_cortex_figures.py, in fewer trials."""
    command = replayed(np.random.default_rng(1))
    truth = draw_population(rng=np.random.default_rng(2)).isel(unit=slice(None, None, EVERY))
    spikes = record_population(truth, command.time.values, command.command.values, TRIALS, rng=np.random.default_rng(3))
    how = EnvelopeAnalysis(delays=tuple(np.unique(command.delay.values)[1:].tolist()))
    units = analysed(spikes, command, how, TRIALS).assign(unit_session=truth.unit_session)
    return fig9.draw(fig9.compute(units, rng=np.random.default_rng(4), truth=truth))


def figures():
    """Give number and figure, one after the other."""
    study = replace(read_study(), laboratory=SWEEPS, comparison=Comparison(gratings=19, jitter=0))
    with TemporaryDirectory() as folder:
        run_study(study, Path(folder) / "out")
        for number in numbers():
            if number != "9":
                yield number, figure_of(number, Path(folder) / "out")
    yield "9", figure_9()


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
