"""Draw the forward chain: a texture, the motion near the base, spikes of 50 units, and what the analysis finds of them.

python docs/make_forward.py [FOLDER]
"""

import sys
from pathlib import Path

import forward_figure as figure
import numpy as np

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.neural.coupling.analysis import analyse_units
from vibrissa.neural.simulated.driven import draw_driven
from vibrissa.study.forward.forward import TrialSettings, forward
from vibrissa.study.report.pages import write_picture
from vibrissa.texture.io import read_gaps
from vibrissa.whisker import atlas_whisker

if __name__ == "__main__":
    here = Path(__file__).parent
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else here
    texture, units = (
        read_gaps(here.parent / "examples" / "grating.csv"),
        draw_driven(50, rng=np.random.default_rng(0)),
    )
    posture, how = Posture(contact=0.29, base_angle=1.2), TrialSettings(n_trials=60, mean_envelope=55e-6)
    spikes = forward(texture, atlas_whisker("C2"), posture, Scan(speed=0.1, damping=0.11), units, how)
    found = analyse_units(spikes, spikes, how.n_trials)
    write_picture(figure.draw(figure.compute(spikes, found)), folder / "forward.png")
