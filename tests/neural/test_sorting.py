"""From raw traces to units: known truth comes back; recordings and folders of other programs open or are refused."""

import json

import numpy as np
import pytest

from vibrissa.errors import InputError
from vibrissa.neural.spikes import spike_table
from vibrissa.neural.traces import RawFormat, open_traces, part

pytest.importorskip("spikeinterface")
pytest.importorskip("hdbscan")

from vibrissa.neural import sorting
from vibrissa.neural.recording import recorded_spikes
from vibrissa.neural.simulated import generate

RATE = 30000.0


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulated")
    return folder, *generate(folder, seed=1, duration=8, channels=6, units=4)


@pytest.fixture(scope="module")
def sorted_units(simulated):
    _, path, how, _ = simulated
    return sorting.sort(open_traces(path, how), "simple")


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
    scores = sorting.accuracy(sorted_units, truth)
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
    assert "unit_waveform" not in sorting.sort(bare, "simple")


@pytest.fixture
def tables():
    """A truth of three units; of the sorted, one is right, one has half, one is nobody's."""
    time = np.arange(1, 101) / 10
    truth = spike_table(np.concatenate([time, time + 0.03, time + 0.06]), np.repeat([0, 1, 2], 100), ["a", "b", "c"])
    found = np.concatenate([time + 2e-4, time[:60] + 0.03, time + 0.05])
    which = np.repeat([0, 1, 2], [100, 60, 100])
    return spike_table(found, which, ["x", "y", "z"], attrs={"sampling_rate": RATE}), truth


def test_scores_are_those_counted_by_hand(tables):
    scores = sorting.accuracy(*tables)
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


# Folders of SpikeInterface


def numpy_sorting(quality=None):
    found = part("core").NumpySorting.from_samples_and_labels(
        [np.array([300, 600, 30300])], [np.array([0, 1, 0])], RATE, unit_ids=["a", "b"]
    )
    if quality:
        found.set_property("quality", quality)
    return found


def trials(folder):
    (folder / "t.csv").write_text("start,stop\n0,0.5\n1,1.5\n")
    return folder / "t.csv"


UNTOLD = pytest.mark.filterwarnings("ignore:The extractor is not serializable")  # a sorting that never was in a file


@UNTOLD
def test_a_saved_sorting_is_read(tmp_path):
    numpy_sorting().save(folder=tmp_path / "f")
    found, _ = recorded_spikes(tmp_path / "f", window=(0.0, 0.5), trials=trials(tmp_path))
    np.testing.assert_allclose(np.sort(found.spike_time), [0.01, 0.01, 0.02])
    assert found.unit_name.values.tolist() == ["a", "b"]
    assert "all 2 units are taken" in found.attrs["remark"]
    with pytest.raises(InputError, match="must tell which units are mua: it does not; leave --group out"):
        recorded_spikes(tmp_path / "f", window=(0.0, 0.5), trials=trials(tmp_path), groups=("mua",))


@UNTOLD
def test_units_that_were_judged_are_chosen_by_their_group(tmp_path):
    numpy_sorting(["good", "noise"]).save(folder=tmp_path / "f")
    found, _ = recorded_spikes(tmp_path / "f", window=(0.0, 0.5), trials=trials(tmp_path))
    assert found.unit_name.values.tolist() == ["a"]
    assert found.unit_quality.values.tolist() == ["SU"]
    assert found.attrs["remark"] == "1 units are good; 1 others are left out"
    with pytest.raises(InputError, match="must have units in the groups mua; there are good, noise"):
        recorded_spikes(tmp_path / "f", window=(0.0, 0.5), trials=trials(tmp_path), groups=("mua",))


def test_folders_of_other_kinds_are_refused(tmp_path, simulated):
    with pytest.raises(InputError, match="must be a folder of phy"):
        recorded_spikes(tmp_path, window=(0.0, 0.5), trials=trials(tmp_path))
    (tmp_path / "si_folder.json").write_text("{}")
    with pytest.raises(InputError, match="holds no sorting that SpikeInterface reads"):
        recorded_spikes(tmp_path, window=(0.0, 0.5), trials=trials(tmp_path))


# Recordings


def noise(folder, n=60000, channels=2, dtype="int16"):
    values = (20 * np.random.default_rng(0).standard_normal((n, channels))).astype(dtype)
    values.tofile(folder / "r.dat")
    return folder / "r.dat"


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
    with pytest.raises(InputError, match=r"must be left out: .* tells where its electrodes are"):
        open_traces(tmp_path / "f", RawFormat(pitch=50e-6))


def open_ephys(folder):
    """A record node of two channels as the Open Ephys GUI 0.6 writes it."""
    where = folder / "Record Node 101" / "experiment1" / "recording1"
    (where / "continuous" / "Acq.A").mkdir(parents=True)
    channels = [{"channel_name": f"CH{k}", "bit_volts": 0.195, "units": "uV"} for k in (1, 2)]
    stream = {"folder_name": "Acq.A/", "sample_rate": 30000, "num_channels": 2, "channels": channels}
    stream |= {
        "source_processor_name": "Acq",
        "source_processor_id": 100,
        "stream_name": "A",
        "recorded_processor_id": 101,
    }
    told = {"GUI version": "0.6.0", "continuous": [stream], "events": [], "spikes": []}
    (where / "structure.oebin").write_text(json.dumps(told))
    noise(folder).rename(where / "continuous" / "Acq.A" / "continuous.dat")
    for name in ("timestamps", "sample_numbers"):
        np.save(
            where / "continuous" / "Acq.A" / f"{name}.npy", np.arange(60000) / (RATE if name == "timestamps" else 1)
        )
    (folder / "Record Node 101" / "settings.xml").write_text(
        "<SETTINGS><INFO><VERSION>0.6.0</VERSION></INFO></SETTINGS>"
    )
    return folder


def test_open_ephys_is_read(tmp_path):
    folder = open_ephys(tmp_path)
    with pytest.raises(InputError, match="must be given where its electrodes are"):
        open_traces(folder)
    traces = open_traces(folder, RawFormat(pitch=25e-6))
    assert traces.get_total_duration() == 2.0
    np.testing.assert_allclose(traces.get_channel_gains(), 0.195)
    with pytest.raises(
        InputError, match=r"must be given one of its streams, got B; --stream NAME; they are Record Node 101#Acq\.A"
    ):
        open_traces(folder, RawFormat(pitch=25e-6, stream="B"))


def spikeglx(folder):
    """A run of four channels of a Neuropixels 1.0 probe, and the line of synchronisation, as SpikeGLX writes them."""
    where = folder / "run_g0" / "run_g0_imec0"
    where.mkdir(parents=True)
    noise(folder, channels=5).rename(where / "run_g0_t0.imec0.ap.bin")
    told = "typeThis=imec\nfileName=D:/run_g0_t0.imec0.ap.bin\nnSavedChans=5\nimSampRate=30000\nimAiRangeMax=0.6\n"
    told += "imAiRangeMin=-0.6\nimMaxInt=512\nimDatPrb_type=0\nimDatPrb_pn=NP1000\nimDatPrb_port=1\nimDatPrb_slot=2\n"
    told += "snsApLfSy=4,0,1\nsnsSaveChanSubset=0:3,768\n~imroTbl=(0,384)"
    told += "".join(f"({k} 0 0 500 250 1)" for k in range(384)) + "\n~snsChanMap=(384,384,1)"
    told += "".join(f"(AP{k};{k}:{k})" for k in range(4)) + "(SY0;768:768)\n"
    (where / "run_g0_t0.imec0.ap.meta").write_text(told)
    return folder


def test_spikeglx_tells_its_probe_and_gain(tmp_path):
    traces = open_traces(spikeglx(tmp_path))
    assert traces.get_num_channels() == 4
    np.testing.assert_allclose(traces.get_channel_gains(), 0.6e6 / 512 / 500)
    np.testing.assert_array_equal(traces.get_channel_locations()[:, 1], [0, 0, 20, 20])


GOOD = {"sampling_rate": RATE, "channels": 2, "pitch": 50e-6}
BAD = {
    "no rate": ({"channels": 2, "pitch": 50e-6}, "must be given its sampling rate; it does not tell: --sampling-rate"),
    "no channels": ({"sampling_rate": RATE, "pitch": 50e-6}, "must be given its channels"),
    "no pitch": ({"sampling_rate": RATE, "channels": 2}, "must be given where its electrodes are"),
    "size": (GOOD | {"channels": 7}, "must be a whole number of samples: 7 channels of int16 are 14 bytes"),
    "kind": (GOOD | {"dtype": "float64"}, "must (hold finite numbers|last at least)"),
    "short": (GOOD | {"sampling_rate": 90000.0}, "must last at least 1 s, got 0.667 s"),
    "kHz": (GOOD | {"sampling_rate": 30.0}, "sampling_rate must be from 5000 to 1e[+]06 Hz"),
    "µm": (GOOD | {"pitch": 50.0}, "pitch must be from 1e-06 to 0.002 m"),
    "no gain": (GOOD | {"gain": 0.0}, "gain must be from"),
    "nan": (GOOD | {"gain": float("nan")}, "gain must be from"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_was_told_of_a_recording_must_fit_it(name, tmp_path):
    told, message = BAD[name]
    with pytest.raises(InputError, match=message) as error:
        open_traces(noise(tmp_path), RawFormat(**told))
    assert "\n" not in str(error.value)


def test_files_that_are_no_recordings_are_refused(tmp_path):
    how = RawFormat(**GOOD)
    with pytest.raises(InputError, match="must be an existing file"):
        open_traces(tmp_path / "no.dat", how)
    noise(tmp_path).rename(tmp_path / "r.txt")
    with pytest.raises(InputError, match=r"must end in \.raw, \.dat, \.bin"):
        open_traces(tmp_path / "r.txt", how)
    (tmp_path / "e.dat").touch()
    with pytest.raises(InputError, match="must be a whole number of samples"):
        open_traces(tmp_path / "e.dat", how)
    np.zeros((60000, 2), "<i2").tofile(tmp_path / "z.dat")
    with pytest.raises(InputError, match="2 of 2 channels constant"):
        open_traces(tmp_path / "z.dat", how)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="must be a folder of SpikeGLX"):
        open_traces(tmp_path / "empty")
    with pytest.raises(InputError, match="sampling_rate must be left out"):
        open_traces(tmp_path / "empty", how)


def test_a_sorter_that_is_not_here_is_refused_with_those_that_are(simulated):
    with pytest.raises(InputError, match=r"sorter kilosort9 must be installed with what it needs; here are .*simple"):
        sorting.sort(None, "kilosort9")


def test_without_the_extra_the_message_says_what_to_install(monkeypatch):
    import vibrissa.neural.traces as traces

    def absent(name):
        raise ImportError(name)

    monkeypatch.setattr(traces, "import_module", absent)
    with pytest.raises(
        InputError, match=r"spike sorting needs spikeinterface; .* -m pip install 'vibrissa\[sorting\]'"
    ):
        sorting.sorters()


WORDS = {
    "truth": (["--truth", "t.csv"], "--truth must go with a recording"),
    "options": (["--channels", "8"], "--channels must go with a recording"),
    "simulation": (["r.dat", "--units", "3"], "--units must be left out"),
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
