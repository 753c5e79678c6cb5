"""Draw the model's Figures 2, 6A–B and 7E, two channels, and Figure 3 of the built-in experiment (two minutes).

python docs/make_figures.py [FOLDER]
"""

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import two_channels

from vibrissa.figures.paper import fig2, fig3, fig6_model, fig7e
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.netcdf import load
from vibrissa.study.movie.virtual import predicted_motion
from vibrissa.study.run.study import run_study
from vibrissa.study.spec.settings import read_study
from vibrissa.study.sweeps.repeats import film_repeats
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.040, cone_angle=1.5e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
SCAN = Scan(speed=0.1, damping=0.11)


def figure_3():
    """The built-in experiment, and its first 0.3 s again: 20 times five runs."""
    study = replace(read_study(), laboratory=None, cortex=None)
    with TemporaryDirectory() as folder:
        run_study(study, Path(folder) / "out")
        results = {path.stem: load(path) for path in (Path(folder) / "out").glob("*.nc")}
    film = replace(study.film, n_frames=600)
    results["repeats"] = film_repeats(predicted_motion(study), film, rng=np.random.default_rng(1))
    return fig3.draw(fig3.compute(results))


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    figures = {
        "fig2.png": fig2.draw(fig2.compute(POSTURE, WHISKER, 0.6e-3, SCAN)),
        "fig3.png": figure_3(),
        "fig6ab.png": fig6_model.draw(fig6_model.compute(POSTURE, WHISKER, SCAN, rng=np.random.default_rng(1))),
        "two-channels.png": two_channels.draw(
            two_channels.compute(POSTURE, WHISKER, SCAN, rng=np.random.default_rng(1))
        ),
        "fig7e.png": fig7e.draw(fig7e.compute(WHISKER)),
    }
    for name, figure in figures.items():
        figure.savefig(folder / name, metadata={"Software": None})
