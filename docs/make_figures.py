"""Draw the model's Figures 2 and 6A–B.

python docs/make_figures.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.figures import fig2, fig6_model
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.superposition import Scan
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.040, cone_angle=1.5e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
SCAN = Scan(speed=0.1, damping=0.11)

if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    figures = {
        "fig2.png": fig2.draw(fig2.compute(POSTURE, WHISKER, 0.6e-3, SCAN)),
        "fig6ab.png": fig6_model.draw(fig6_model.compute(POSTURE, WHISKER, SCAN, rng=np.random.default_rng(1))),
    }
    for name, figure in figures.items():
        figure.savefig(folder / name, metadata={"Software": None})
