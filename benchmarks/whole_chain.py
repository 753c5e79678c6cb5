"""The whole chain: texture, whisker, envelope, spikes, raw traces, sorted units, and the thresholds they were given.

python benchmarks/whole_chain.py [SEED]
"""

import sys
from tempfile import TemporaryDirectory

import numpy as np

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.io.formats.traces import open_traces
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.trials import cut_into_trials, trials_at
from vibrissa.neural.simulated.driven import draw_driven
from vibrissa.neural.sorting.simulated import generate
from vibrissa.neural.sorting.sorters import accuracy, sort
from vibrissa.study.forward.forward import TrialSettings, forward
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.055, cone_angle=1.2e-3, tip=0.05)
POSTURE, SCAN = Posture(contact=0.29, base_angle=1.2), Scan(speed=0.1, damping=0.11)
UNITS, TRIALS, PAUSE = 5, 40, 0.2


def main(seed):
    texture, units = (
        random_grating(0.3, rng=np.random.default_rng(seed)),
        draw_driven(UNITS, rng=np.random.default_rng(seed)),
    )
    units["unit_quality"] = ("unit", np.repeat("SU", UNITS))  # one neuron each
    how = TrialSettings(n_trials=TRIALS, seed=seed, mean_envelope=55e-6)
    spikes = forward(texture, WHISKER, POSTURE, SCAN, units, how, sampling_rate=4000.0)
    duration = spikes.attrs["duration"]
    onset = 1.0 + (duration + PAUSE) * np.arange(TRIALS)
    session = spike_table(
        onset[spikes.spike_trial.values] + spikes.spike_time.values,
        spikes.spike_unit.values,
        units.unit_name.values.tolist(),
    )
    with TemporaryDirectory() as folder:
        path, format_, truth = generate(folder, seed=seed, spikes=session)
        found = sort(open_traces(path, format_), seed=seed)
    scores = accuracy(found, truth)
    fits = analyse_units(cut_into_trials(found, trials_at(onset, duration)), spikes, TRIALS, EnvelopeAnalysis(skip=0.1))
    names = fits.unit_name.values.tolist()
    print("unit   SNR  accuracy  threshold [µm]: put in, found           slope [AP/s/µm]: put in, found")
    for k, match in enumerate(scores.matched_unit.values.tolist()):
        score = (
            f"{units.unit_name.values[k]}  {float(scores.true_snr[k]):4.1f}  {float(scores.sorting_accuracy[k]):8.3f}"
        )
        if match not in names:
            print(f"{score}  not found by the sorter")
            continue
        one = fits.isel(unit=names.index(match))
        shown = [
            f"{scale * float(units[f'true_{name}'][k]):7.3g}, {scale * float(one[name]):.3g} "
            f"[{scale * float(one[f'{name}_low']):.3g}, {scale * float(one[f'{name}_high']):.3g}]"
            for name, scale in (("threshold", 1e6), ("slope", 1e-6))
        ]
        print(f"{score}  {'   '.join(shown)}  {one.reason.values!s}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1)
