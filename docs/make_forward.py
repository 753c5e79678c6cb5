"""Draw the forward chain: a texture, the motion near the base, spikes of 50 units, and what the analysis finds of them.

python docs/make_forward.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.figures import forward as figure
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.superposition import Scan
from vibrissa.neural.analysis import analyse_units
from vibrissa.neural.driven import draw_driven
from vibrissa.study.forward import Presentation, forward
from vibrissa.texture.io import read_troughs
from vibrissa.whisker import atlas_whisker

if __name__ == "__main__":
    here = Path(__file__).parent
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else here
    texture, units = (
        read_troughs(here.parent / "examples" / "grating.csv"),
        draw_driven(50, rng=np.random.default_rng(0)),
    )
    posture, how = Posture(contact=0.29, base_angle=1.2), Presentation(n_trials=60, mean_envelope=55e-6)
    spikes = forward(texture, atlas_whisker("C2"), posture, Scan(speed=0.1, damping=0.11), units, how)
    found = analyse_units(spikes, spikes, how.n_trials)
    figure.draw(figure.compute(spikes, found)).savefig(folder / "forward.png", metadata={"Software": None})
