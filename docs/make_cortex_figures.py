"""Draw Figures 8 and 9 from a simulated population: textures, whisker, stimulator, spikes, analysis.

python docs/make_cortex_figures.py [FOLDER]

The same as a study file that says no more than [cortex], with its defaults.
"""

import sys
from pathlib import Path

from vibrissa.study.neurons.cortex import run_cortex
from vibrissa.study.spec.cortex import Cortex
from vibrissa.study.stages.figure_table import best_entry

if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    results = run_cortex(Cortex())
    for number in "89":
        figure = best_entry(number, results).make(results, None)
        figure.savefig(folder / f"fig{number}.png", metadata={"Software": None})
