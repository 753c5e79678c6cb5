"""From raw traces to units: known truth comes back; recordings and folders of other programs open or are refused."""

import json

import numpy as np
import pytest
from recording_folders import RATE, noise, open_ephys, spikeglx
from refusals import refusal

from vibrissa.neural.io.formats.traces import RawFormat, open_traces
from vibrissa.neural.io.tables.spikes import spike_table

pytest.importorskip("spikeinterface", reason="the extra sorting is not installed")
pytest.importorskip("hdbscan", reason="the extra sorting is not installed")

from vibrissa.neural.io.recording import recorded_spikes
from vibrissa.neural.sorting import sorters
from vibrissa.neural.sorting.simulated import generate
from vibrissa.neural.sorting.waveform_groups import waveform_groups


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulated")
    return folder, *generate(folder, seed=1, duration=8, channels=6, units=4)


@pytest.fixture(scope="module")
def sorted_units(simulated):
    _, path, how, _ = simulated
    return sorters.sort(open_traces(path, how), "simple")


def coincidences(one, other, within):
    """Pairs of spikes of two ascending trains that can be made, each spike in one pair."""
    i = j = pairs = 0
    while i < len(one) and j < len(other):
        if abs(one[i] - other[j]) <= within:
            pairs, i, j = pairs + 1, i + 1, j + 1
        elif one[i] < other[j]:
            i += 1
        else:
            j += 1
    return pairs


def train(table, name):
    k = table.unit_name.values.tolist().index(name)
    return table.spike_time.values[table.spike_unit.values == k]


def test_known_units_come_back(simulated, sorted_units):
    truth = simulated[3]
    scores = sorters.accuracy(sorted_units, truth)
    clear = scores.true_snr.values > 8
    assert clear.sum() >= 3
    assert (scores.sorting_accuracy.values[clear] > 0.5).all()  # no template matching: overlapping spikes are missed
    assert (scores.sorting_precision.values[clear] > 0.9).all()
    assert sorted_units.attrs["duration"] == pytest.approx(8.0)
    for k, name in enumerate(scores.matched_unit.values.tolist()):
        if not name:
            continue
        ours, true = train(sorted_units, name), train(truth, f"true {k + 1}")
        right = coincidences(ours, true, 0.4e-3)
        assert scores.sorting_recall.values[k] == pytest.approx(right / len(true))
        assert scores.sorting_precision.values[k] == pytest.approx(right / len(ours))
        assert scores.sorting_accuracy.values[k] == pytest.approx(right / (len(true) + len(ours) - right))


def test_units_are_seen_above_the_noise_on_an_electrode(sorted_units):
    assert (sorted_units.snr_mean.values > 3).all()
    assert set(sorted_units.unit_electrode.values.tolist()) <= set(range(6))
    assert sorted_units.attrs["sorter"] == "simple"


def test_waveforms_are_in_volts_where_the_gain_is_known(simulated, sorted_units):
    _, path, how, _ = simulated
    height = np.ptp(sorted_units.unit_waveform.values, axis=1)
    noise = 12e-6 * np.sqrt((6000 - 300) / (RATE / 2))  # the white noise that was put in, within the band
    np.testing.assert_allclose(height / sorted_units.snr_mean.values, noise, rtol=0.1)
    bare = open_traces(path, RawFormat(sampling_rate=RATE, channels=6, pitch=how.pitch))
    assert "unit_waveform" not in sorters.sort(bare, "simple")


@pytest.fixture
def tables():
    """A truth of three units; of the sorted, one is right, one has half, one is nobody's."""
    time = np.arange(1, 101) / 10
    truth = spike_table(np.concatenate([time, time + 0.03, time + 0.06]), np.repeat([0, 1, 2], 100), ["a", "b", "c"])
    found = np.concatenate([time + 2e-4, time[:60] + 0.03, time + 0.05])
    which = np.repeat([0, 1, 2], [100, 60, 100])
    return spike_table(found, which, ["x", "y", "z"], attrs={"sampling_rate": RATE}), truth


def test_scores_are_those_counted_by_hand(tables):
    scores = sorters.accuracy(*tables)
    assert scores.matched_unit.values.tolist() == ["x", "y", ""]
    np.testing.assert_allclose(scores.sorting_accuracy, [1, 0.6, 0])
    np.testing.assert_allclose(scores.sorting_recall, [1, 0.6, 0])
    np.testing.assert_allclose(scores.sorting_precision, [1, 1, np.nan])
    assert int(scores.units_unmatched) == 1


def test_equal_seeds_give_equal_recordings(simulated, tmp_path):
    path, _, truth = generate(tmp_path, seed=1, duration=8, channels=6, units=4)
    assert path.read_bytes() == simulated[1].read_bytes()
    assert truth.identical(simulated[3])


def test_the_verb_sorts_and_neural_reads_what_it_wrote(simulated, vibrissa, tmp_path):
    folder, path, _, _ = simulated
    told = ("--sampling-rate", "30000", "--channels", "6", "--gain", "2e-7", "--pitch", "20e-6", "--sorter", "simple")
    files = ("--truth", folder / "truth.csv", "--spikes-out", tmp_path / "s.csv", "--out", tmp_path / "s.nc")
    code, text, err = vibrissa("sort", path, *told, *files, "--json")
    assert code == 0, err
    data = json.loads(text)
    assert max(data["sorting_accuracy"]) > 0.8
    assert "on 6 channels, by simple" in err
    (tmp_path / "trials.csv").write_text("start,stop\n1,3\n4,6\n")
    for name in ("s.csv", "s.nc"):
        found, count = recorded_spikes(tmp_path / name, window=(0.0, 2.0), trials=tmp_path / "trials.csv")
        assert count == 2
        assert found.unit_name.values.tolist() == data["unit_name"]
        assert 0 < found.spike_time.values.min() < found.spike_time.values.max() < 2


# One channel, and clusters of several neurons


@pytest.fixture(scope="module")
def one_channel(tmp_path_factory):
    path, how, truth = generate(tmp_path_factory.mktemp("one"), seed=1, duration=20, channels=1, units=2)
    return open_traces(path, RawFormat(sampling_rate=RATE, channels=1, gain=how.gain)), truth  # no pitch


def test_the_default_sorts_one_channel(one_channel):
    traces, truth = one_channel
    found = sorters.sort(traces)
    assert found.attrs["sorter"] == "simple"
    assert (sorters.accuracy(found, truth).sorting_accuracy.values > 0.9).all()
    assert not found.merged.any()


def test_a_cluster_of_two_neurons_is_flagged_and_theirs_are_not(one_channel):
    traces, truth = one_channel
    both = spike_table(truth.spike_time.values, np.zeros(truth.sizes["spike"], int), ["both"])
    how = {"sorter": "none", "sorter_seed": 0}
    merged = sorters.labelled(traces, sorters.numbered(both, RATE), how)
    assert merged.merged.values.tolist() == [True]
    assert merged.waveform_groups.values.tolist() == [2]
    assert "waveforms of 2 groups, a merged cluster" in merged.reason.item()
    single = sorters.labelled(traces, sorters.numbered(truth, RATE), how)
    assert single.waveform_groups.values.tolist() == [1, 1]
    assert not single.merged.any()


def test_one_neuron_is_one_group_though_its_amplitude_varies():
    rng, shape = np.random.default_rng(0), np.exp(-0.5 * ((np.arange(60) - 20) / 3) ** 2)
    other = np.exp(-0.5 * ((np.arange(60) - 24) / 6) ** 2)
    noise, varied = rng.normal(0, 0.1, (400, 60)), rng.gamma(20, 0.05, (400, 1))
    assert waveform_groups(varied * shape + noise) == 1
    assert waveform_groups(np.where(np.arange(400)[:, None] < 150, shape, other) + noise) == 2
    assert waveform_groups(np.where(np.arange(400)[:, None] < 20, shape, other) + noise) == 1  # too few for a group
    assert waveform_groups(noise[:30]) == 1


# Recordings


def test_bare_samples_are_read_as_told(tmp_path):
    path = noise(tmp_path)
    traces = open_traces(path, RawFormat(sampling_rate=RATE, channels=2, gain=1e-6, pitch=50e-6))
    assert traces.get_total_duration() == 2.0
    np.testing.assert_array_equal(traces.get_channel_locations()[:, 1], [0, 50])
    samples = np.fromfile(path, "<i2").reshape(-1, 2)
    np.testing.assert_array_equal(traces.get_traces(start_frame=10, end_frame=20), samples[10:20])


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # what it saves it leaves open
def test_a_folder_of_spikeinterface_is_a_recording(tmp_path):
    how = RawFormat(sampling_rate=RATE, channels=2, pitch=50e-6)
    open_traces(noise(tmp_path), how).save(folder=tmp_path / "f", progress_bar=False)
    found = open_traces(tmp_path / "f")
    assert found.get_num_channels() == 2
    with refusal("conflict", "RawFormat.pitch"):
        open_traces(tmp_path / "f", RawFormat(pitch=50e-6))


def test_open_ephys_is_read(tmp_path):
    folder = open_ephys(tmp_path)
    with refusal("missing", "test_open_ephys_is_read0"):
        open_traces(folder)
    traces = open_traces(folder, RawFormat(pitch=25e-6))
    assert traces.get_total_duration() == 2.0
    np.testing.assert_allclose(traces.get_channel_gains(), 0.195)
    with refusal("missing", "test_open_ephys_is_read0", value="B"):
        open_traces(folder, RawFormat(pitch=25e-6, stream="B"))


def test_spikeglx_tells_its_probe_and_gain(tmp_path):
    traces = open_traces(spikeglx(tmp_path))
    assert traces.get_num_channels() == 4
    np.testing.assert_allclose(traces.get_channel_gains(), 0.6e6 / 512 / 500)
    np.testing.assert_array_equal(traces.get_channel_locations()[:, 1], [0, 0, 20, 20])


GOOD = {"sampling_rate": RATE, "channels": 2, "pitch": 50e-6}
BAD = {
    "no rate": (
        {"channels": 2, "pitch": 50e-6},
        ("missing", "r.dat"),
        "must be given its sampling rate",
        "the file does not state it: --sampling-rate",
    ),
    "no channels": ({"sampling_rate": RATE, "pitch": 50e-6}, ("missing", "r.dat"), "must be given its channels"),
    "no pitch": (
        {"sampling_rate": RATE, "channels": 2},
        ("missing", "r.dat"),
        "must be given where its electrodes are",
    ),
    "size": (
        GOOD | {"channels": 7},
        ("range", "r.dat", "240000 bytes"),
        "must be a whole number of samples: 7 channels of int16 are 14 bytes for each sample",
    ),
    "kind": (GOOD | {"dtype": "float64"}, ("too-few", "r.dat", "0.5 s"), "must last at least 1 s"),
    "short": (GOOD | {"sampling_rate": 90000.0}, ("too-few", "r.dat", "0.667 s"), "must last at least 1 s"),
    "kHz": (
        GOOD | {"sampling_rate": 30.0},
        ("range", "RawFormat.sampling_rate", "30.0"),
        "must be from 5000 to 1e+06 Hz",
    ),
    "µm": (GOOD | {"pitch": 50.0}, ("range", "RawFormat.pitch", "50.0"), "must be from 1e-06 to 0.002 m"),
    "no gain": (GOOD | {"gain": 0.0}, ("range", "RawFormat.gain", "0.0"), "must be from 1e-12 to 1 V per step"),
    "nan": (GOOD | {"gain": float("nan")}, ("range", "RawFormat.gain", "nan"), "must be from 1e-12 to 1 V per step"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_was_told_of_a_recording_must_fit_it(name, tmp_path):
    told, fields, rule, *remedy = BAD[name]
    with refusal(*fields) as caught:
        open_traces(noise(tmp_path), RawFormat(**told))
    assert caught.value.rule == rule
    assert caught.value.remedy.startswith(tuple(remedy) or "")


def test_files_that_are_no_recordings_are_refused(tmp_path):
    how = RawFormat(**GOOD)
    with refusal("missing", "no.dat"):
        open_traces(tmp_path / "no.dat", how)
    noise(tmp_path).rename(tmp_path / "r.txt")
    with refusal("format", "r.txt"):
        open_traces(tmp_path / "r.txt", how)
    (tmp_path / "e.dat").touch()
    with refusal("range", "e.dat"):
        open_traces(tmp_path / "e.dat", how)
    np.zeros((60000, 2), "<i2").tofile(tmp_path / "z.dat")
    with refusal("too-few", "z.dat"):
        open_traces(tmp_path / "z.dat", how)
    (tmp_path / "empty").mkdir()
    with refusal("missing", "empty"):
        open_traces(tmp_path / "empty")
    with refusal("conflict", "RawFormat.sampling_rate"):
        open_traces(tmp_path / "empty", how)


def test_a_sorter_that_is_not_here_is_refused_with_those_that_are(simulated):
    with refusal("package", "sorter kilosort9"):
        sorters.sort(None, "kilosort9")


def test_without_the_extra_the_message_says_what_to_install(monkeypatch):
    import vibrissa.neural.io.formats.foreign as foreign

    def absent(name):
        raise ImportError(name)

    monkeypatch.setattr(foreign, "import_module", absent)
    with refusal("package", "spike sorting"):
        sorters.sorters()


WORDS = {
    "truth": (["--truth", "t.csv"], "--truth must go with a recording"),
    "options": (["--channels", "8"], "--channels must go with a recording"),
    "simulation": (["r.dat", "--n-units", "3"], "--n-units must be left out"),
    "name": (["--spikes-out", "s.nwb"], "--spikes-out must end in .csv"),
    "duration": (["--duration", "1"], "duration must be from 5 to 600"),
    "folder": (["--keep", "no"], "no must be an existing folder"),
    "file": (["no.dat"], "no.dat must be an existing file"),
}


@pytest.mark.parametrize("name", WORDS)
def test_the_verb_refuses_in_one_line(name, vibrissa, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words, message = WORDS[name]
    code, out, err = vibrissa("sort", *words)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())
