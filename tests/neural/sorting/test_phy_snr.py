"""Signal to noise of phy's clusters from the raw data that params.py names: known waveforms in known noise."""

import json
import shutil

import numpy as np
import pytest
from refusals import refusal
from scipy.signal import butter, sosfiltfilt

from vibrissa.neural.io.formats.phy import read_phy
from vibrissa.neural.io.formats.phy_traces import phy_traces, traced_snr

RATE, CHANNELS, SECONDS, NOISE = 30_000, 4, 20, 10.0
HEIGHTS, ON = (200.0, 80.0), (1, 3)  # of the units' waveforms, in steps; their channels
AT = np.arange(-15, 30)
SHAPE = -np.exp(-0.5 * (AT / 4) ** 2) + 0.5 * np.exp(-0.5 * ((AT - 11) / 5) ** 2)
SHAPE = SHAPE / np.ptp(SHAPE)


def band(values):
    return sosfiltfilt(butter(2, (300, 6000), "bandpass", fs=RATE, output="sos"), values)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two clusters, 0 and 1; one spike of cluster 0 is half as high; a slow wave on all channels."""
    path, rng = tmp_path_factory.mktemp("phy"), np.random.default_rng(4)
    raw = NOISE * rng.normal(size=(SECONDS * RATE, CHANNELS))
    raw += 300 * np.sin(2 * np.pi * 3 * np.arange(len(raw)) / RATE)[:, None]
    at = np.sort(rng.choice(np.arange(100, len(raw) - 100, 100), 160, replace=False))
    cluster = np.arange(at.size) % 2
    for k, (sample, one) in enumerate(zip(at, cluster, strict=True)):
        raw[sample - 15 : sample + 30, ON[one]] += HEIGHTS[one] * SHAPE * (0.5 if k == 40 else 1)
    raw.round().astype("<i2").tofile(path / "recording.dat")
    np.save(path / "spike_times.npy", at)
    np.save(path / "spike_clusters.npy", cluster)
    (path / "params.py").write_text(
        f"dat_path = 'recording.dat'\nn_channels_dat = {CHANNELS}\ndtype = 'int16'\noffset = 0\n"
        f"sample_rate = {RATE}.\nhp_filtered = False\n"
    )
    return path


def test_smallest_and_mean_waveform_of_known_height_in_known_noise(folder):
    found = traced_snr(read_phy(folder, groups=("all",)), phy_traces(folder))
    noise = band(NOISE * np.random.default_rng(0).normal(size=RATE * 20)).std()
    heights = np.array([np.ptp(band(np.pad(one * SHAPE, 300))) for one in HEIGHTS])
    np.testing.assert_allclose(found.snr_mean, heights / noise, rtol=0.05)
    # noise moves the peak and the trough of one waveform by some rms in all
    assert found.snr_smallest.values[0] == pytest.approx(heights[0] / 2 / noise, abs=3)
    assert heights[1] / noise - 4 < found.snr_smallest.values[1] < heights[1] / noise


def test_a_rate_that_is_given_by_two_names_is_read_alike(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "phy")
    params = tmp_path / "phy" / "params.py"
    params.write_text(params.read_text().replace("sample_rate", "fs = sample_rate"))
    spikes = read_phy(tmp_path / "phy", groups=("all",))
    assert spikes.attrs["sampling_rate"] == phy_traces(tmp_path / "phy").rate == RATE


def test_the_verb_says_where_the_signal_to_noise_is_from(folder, vibrissa, tmp_path):
    code, text, err = vibrissa("quality", folder, "--json")
    assert code == 0, err
    found = json.loads(text)
    assert found["snr_source"] == ["smallest waveform"] * 2
    assert found["snr_smallest"] == found["unit_snr"]
    assert (np.array(found["snr_mean"]) > found["snr_smallest"]).all()
    for name in ("spike_times.npy", "spike_clusters.npy", "params.py"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    code, text, err = vibrissa("quality", tmp_path, "--json")
    assert json.loads(text)["unit_snr"] == [None, None]
    assert "SNR is not measured: 2; the raw data that params.py names, recording.dat, are not at hand" in err


def test_raw_data_of_another_size_are_refused(folder, tmp_path):
    for name in ("spike_times.npy", "spike_clusters.npy", "params.py"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / "recording.dat").write_bytes(b"12345")
    with refusal("range", "recording.dat", "5 bytes"):
        phy_traces(tmp_path)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("n_channels_dat = 'four'", "params.py, n_channels_dat must be a whole number from 1"),
        ("n_channels_dat = 0", "params.py, n_channels_dat must be a whole number from 1"),
        ("offset = -4", "params.py, offset must be a whole number from 0"),
        ("dtype = 'object'", "params.py, dtype must be one of int16"),
        ("dat_path = 7", ""),
        ("dat_path = ['a.dat', 'b.dat']", ""),
        ("dat_path = input()", ""),
    ],
)
def test_odd_lines_of_params_are_refused_or_left(folder, tmp_path, vibrissa, line, words):
    for name in ("spike_times.npy", "spike_clusters.npy", "params.py", "recording.dat"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    with (tmp_path / "params.py").open("a") as file:
        file.write(f"{line}\n")
    code, _, err = vibrissa("quality", tmp_path)
    assert (code == 2) == bool(words), err
    assert words in err
    assert code == 0 or err.count("\n") == 1
