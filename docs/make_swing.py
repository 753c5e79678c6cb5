"""Draw docs/swing.png, six frames of the movie of a whole whisker that lands on ridges, sweeps them and leaves.

python docs/make_swing.py [FOLDER]

The same as ``vibrissa whisking examples/ridges.csv examples/sweep.csv --model rod`` of docs/howto-surface.md.
"""

import sys
from pathlib import Path

import matplotlib.image
import numpy as np

from vibrissa.figures.others.rod_movie import chosen_times, frames
from vibrissa.mechanics.whisking.base_path import read_base_path
from vibrissa.mechanics.whisking.swing_prediction import SwingPrediction, event_lines, swing_film
from vibrissa.texture.io import read_texture
from vibrissa.whisker import Whisker

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"
WHISKER = Whisker(length=0.040, cone_angle=1.5e-3, tip=0.15)
SHOWN = (16e-3, 34e-3, 80e-3, 120e-3, 160e-3, 230e-3)  # [s]


def main(folder: Path) -> None:
    """Draw the sheet."""
    path, surface = read_base_path(EXAMPLES / "sweep.csv"), read_texture(EXAMPLES / "ridges.csv")
    prediction = SwingPrediction(WHISKER, path, surface, 0.0, 0.11)
    print(*event_lines(prediction.sampled(20e3)), sep="\n")
    film = swing_film(prediction, 5e3)
    times = film.time[chosen_times(film)]
    records = chosen_times(film)[[int(np.abs(times - t).argmin()) for t in SHOWN]]
    pictures = list(frames(film, records))
    sheet = np.vstack([np.hstack(pictures[k : k + 2]) for k in range(0, len(pictures), 2)])
    matplotlib.image.imsave(folder / "swing.png", sheet)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
