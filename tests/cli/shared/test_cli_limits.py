"""Numbers that no machine can serve are refused before anything is computed, each in one line with its limit."""

from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[3] / "examples"
AT = "--contact 0.29 --base-angle 70deg --atlas C2"
MAP = "map --contact 0.2:0.4:{n} --base-angle 45deg:80deg:{n} --speed 100mm/s --atlas C2 --texture {e}/grating.csv"
OF_SPIKES = "--spikes {t}/spikes.csv --stimulus {t}/stimulus.csv --trials 3"
CASES = [
    ("modes --contact 0.29 --atlas C2 --n-modes 1000", "--n-modes must be between 1 and 40"),
    (MAP.replace("{n}", "100000"), "map must fit into"),
    (f"scan {{e}}/grating.csv {AT} --speed 100mm/s --sampling-rate 1e12Hz", "at most 2,000,000 samples"),
    (f"scan {{e}}/grating.csv {AT} --speed 1nm/s", "at most 2,000,000 samples"),
    (f"scan {{e}}/grating.csv {AT} --speed 1um/s --model rod", "at most 2,000,000 samples"),
    (f"gap {AT} --gap-width 0.4mm --model rod --speed 1nm/s", "at most 2,000,000 samples"),
    (f"neural {OF_SPIKES} --bin-width 1e-12s", "--window must hold at most 1,000,000 bins"),
    (f"demodulation {OF_SPIKES} --bin-width 1e-12s", "--window must hold at most 1,000,000 bins"),
    (f"glm {OF_SPIKES} --reach 1e6s", "--reach must hold at most 10,000 bins"),
    (f"glm {OF_SPIKES} --past 1e6s", "--past must hold at most 10,000 bins"),
    ("information --spikes {t}/spikes.csv --window 0 1e12 --trials 3", "--window must hold at most 1,000,000 bins"),
    ("discriminate {t}/spikes.csv --textures {t}/t.csv --window 0 1 --permutations 1000000000", "at most 1,000,000"),
    ("discriminate {t}/spikes.csv --textures {t}/t.csv --window 0 1 --bin-width 1e-12", "at most 1,000,000 bins"),
    (f"robustness {AT} --speed 100mm/s --sets 1000000000", "must be 2 to 10,000 of each"),
    (f"robustness {AT} --speed 100mm/s --trials 1000000000", "must be 2 to 10,000 of each"),
]


@pytest.fixture
def inputs(tmp_path):
    time = np.arange(2000) / 2000
    rows = [f"{t},{1e-5 * np.sin(2000 * t) * (1.5 + np.sin(9 * t))}" for t in time]
    (tmp_path / "stimulus.csv").write_text("time,displacement_m\n" + "\n".join(rows) + "\n")
    spikes = [f"a,{k},{t:.4f}" for k in range(3) for t in np.random.default_rng(k).uniform(0, 1, 50)]
    (tmp_path / "spikes.csv").write_text("unit,trial,spike_time\n" + "\n".join(spikes) + "\n")
    (tmp_path / "t.csv").write_text("trial,texture\n0,a\n1,b\n2,a\n")
    return tmp_path


@pytest.mark.parametrize(("words", "line"), CASES)
def test_what_no_machine_can_serve_is_refused(vibrissa, inputs, words, line):
    code, out, err = vibrissa(*(word.format(e=EXAMPLES, t=inputs) for word in words.split()))
    assert (code, out) == (2, ""), err
    assert line in err.splitlines()[-1], err


@pytest.mark.parametrize(
    ("part", "line"),
    [
        ("[film]\nn_frames = 4000000000", "Film must fit into"),
        ("[film]\nn_frames = 100\nsubframes = 1000000000", "Film must fit into"),
        ("[film]\nn_frames = 100\ncamera = { width = 10000000, height = 10000000 }", "Camera must fit into"),
        ("[laboratory]\nanimals = 1000\nconditions = 1000", "Laboratory must have at most 100,000 sweeps"),
        ("[cortex]\nn_trials = 1000000000", "Cortex.n_trials must be 1 to 10,000"),
    ],
)
def test_what_no_study_can_hold_is_refused(vibrissa, tmp_path, part, line):
    (tmp_path / "large.toml").write_text(f'name = "Large"\n\n{part}\n')
    code, out, err = vibrissa("study", tmp_path / "large.toml")
    assert (code, out) == (2, "")
    assert line in err, err
    assert len(err.splitlines()) == 1
