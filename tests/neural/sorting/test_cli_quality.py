"""The verb quality: units of any file in their classes, with the reason of each that is left out."""

import json
from pathlib import Path

import numpy as np
import pytest
from plexon_files import write_plx
from refusals import refusal

import vibrissa as vb
from vibrissa.neural.io.formats.plexon import plexon_waveforms
from vibrissa.neural.io.tables.spike_csv import read_spikes, write_csv
from vibrissa.neural.io.tables.spikes import spike_table

REAL = Path(__file__).parents[4] / "shared" / "data" / "spikes" / "A8604-211122.nwb"
SPREAD = np.arange(0.05, 100, 0.1)
PARAMS = "dat_path = 'recording.dat'\nn_channels_dat = 8\ndtype = 'int16'\noffset = 0\nsample_rate = 30000.\n"


@pytest.fixture
def phy(tmp_path):
    """Clusters 3 (good), 5 (good, with pairs 0.5 ms apart), 7 (mua, the same), 8 (noise), 9 (never judged)."""
    close = np.sort(np.append(SPREAD, SPREAD[:50] + 5e-4))
    trains = {3: SPREAD, 5: close, 7: close, 8: SPREAD, 9: SPREAD}
    time = np.concatenate(list(trains.values()))
    cluster = np.repeat(list(trains), [len(one) for one in trains.values()])
    np.save(tmp_path / "spike_times.npy", np.round(30_000 * time).astype(np.int64))
    np.save(tmp_path / "spike_clusters.npy", cluster.astype(np.int32))
    np.save(tmp_path / "amplitudes.npy", np.where(cluster == 3, 20 - 0.1 * time, 20.0))
    (tmp_path / "params.py").write_text(PARAMS)
    (tmp_path / "cluster_group.tsv").write_text("cluster_id\tgroup\n3\tgood\n5\tgood\n7\tmua\n8\tnoise\n")
    (tmp_path / "cluster_info.tsv").write_text(
        "cluster_id\tSNR\tgroup\n3\t8.5\tgood\n5\t4\tgood\n7\t2.5\tmua\n8\t\tnoise\n"
    )
    return tmp_path


def test_a_folder_of_phy_is_judged_in_classes(phy, vibrissa):
    code, text, err = vibrissa("quality", phy, "--json", "--out", phy / "q.nc")
    assert code == 0, err
    found = json.loads(text)
    assert found["unit_class"] == ["good", "good", "mua", "noise", "unlabelled"]
    assert found["kept"] == [True, False, True, False, True]
    assert found["reason"][1] == "4.77 % of intervals below 1 ms, more than 0 %"
    assert found["unit_snr"] == [8.5, 4.0, 2.5, None, None]
    assert found["snr_source"] == ["cluster_info.tsv"] * 3 + ["", ""]
    assert found["amplitude_change"][0] == pytest.approx(-10 / 15, abs=0.01)
    assert "kept: 1 of 2 good, 1 of 1 mua, 1 of 1 unlabelled, 0 of 1 noise" in err
    assert "from the first spike to the last" in err
    assert vb.load(phy / "q.nc").attrs["clock_step"] == pytest.approx(1 / 30_000)


def test_the_units_kept_are_those_of_the_other_verbs(phy, vibrissa):
    assert vibrissa("quality", phy, "--out", phy / "q.nc", "--least-snr", "3")[0] == 0
    (phy / "t.csv").write_text("start,stop\n0,50\n50,100\n")
    (phy / "textures.csv").write_text("trial,texture\n0,a\n1,b\n")
    from vibrissa.study.neurons.inputs import read_spikes as read
    from vibrissa.study.spec.given import SpikesInput

    given = SpikesInput(spikes=str(phy), trial_table=str(phy / "t.csv"), kept=str(phy / "q.nc"))
    spikes, count, remarks = read(given, (0.0, 50.0))
    assert spikes.unit_name.values.tolist() == ["3", "9"]
    assert count == 2
    assert any("2 of 5 units are kept by q.nc" in line for line in remarks)
    good = SpikesInput(spikes=str(phy), trial_table=str(phy / "t.csv"), kept=str(phy / "q.nc"), group=("good",))
    assert read(good, (0.0, 50.0))[0].unit_name.values.tolist() == ["3"]


def test_units_kept_elsewhere_are_refused(phy, tmp_path):
    from vibrissa.study.neurons.inputs import read_session
    from vibrissa.study.spec.given import SpikesInput

    vb.save(vb.unit_quality({"3": SPREAD}), phy / "other.nc")
    with refusal("shape", "other.nc", "no unit 5"):
        read_session(SpikesInput(spikes=str(phy), kept=str(phy / "other.nc")))


def test_options_of_trials_limit_what_is_judged(tmp_path, vibrissa):
    write_csv(spike_table(SPREAD[SPREAD < 50], np.zeros(500, int), ["a"]), tmp_path / "s.csv")
    _code, text, err = vibrissa("quality", tmp_path / "s.csv", "--json", "--duration", "100s")
    assert json.loads(text)["unit_rate"] == [5.0], err
    (tmp_path / "t.csv").write_text("start,stop,protocol\n0,10,x\n40,60,x\n80,90,y\n")
    told = ("--trial-table", tmp_path / "t.csv", "--only", "protocol", "x", "--json")
    _code, text, err = vibrissa("quality", tmp_path / "s.csv", *told)
    found = json.loads(text)
    assert found["time_observed"] == [30.0]
    assert found["unit_rate"] == [pytest.approx(200 / 30)]
    assert "units are judged in 2 trials" in err
    _code, text, err = vibrissa(
        "quality", tmp_path / "s.csv", "--period", "10s", "--trials", "2", "--window", "0", "5", "--json"
    )
    assert json.loads(text)["time_observed"] == [10.0], err


def test_spikes_in_trials_are_judged_there(tmp_path, vibrissa):
    table = spike_table(np.tile(SPREAD[SPREAD < 2], 3), np.zeros(60, int), ["a"], trial=np.repeat([0, 1, 2], 20))
    write_csv(table.assign_attrs(n_trials=6), tmp_path / "s.csv")
    _code, text, err = vibrissa("quality", tmp_path / "s.csv", "--window", "0", "2", "--json")
    assert json.loads(text)["unit_rate"] == [5.0], err
    code, _, err = vibrissa("quality", tmp_path / "s.csv", "--trials", 12, "--window", "0", "2")
    assert (code, "--trials must be left out: the recording has 6, got 12" in err) == (2, True), err
    assert vibrissa("quality", tmp_path / "s.csv")[2].count("trials are taken to last from 0 to 1.95 s") == 1


@pytest.mark.parametrize("option", [("--period", "2s"), ("--trial-table", "trials.csv")])
def test_spikes_in_trials_are_not_cut_again(option, tmp_path, vibrissa):
    (tmp_path / "spikes.csv").write_text("unit,trial,spike_time\na,0,0.1\na,1,0.2\n")
    (tmp_path / "trials.csv").write_text("start,stop\n0,1\n2,3\n")
    name, value = option
    value = tmp_path / value if value.endswith("csv") else value
    code, _out, err = vibrissa("quality", tmp_path / "spikes.csv", "--trials", "2", name, value)
    assert code == 2
    assert f"{name} must go with spikes on a session's clock" in err
    with refusal("conflict", "trials"):
        vb.unit_quality(vb.read_spikes(tmp_path / "spikes.csv"), trials=[(0.0, 1.0), (2.0, 3.0)])


def test_a_csv_may_state_the_signal_to_noise_and_gives_it_back(tmp_path, vibrissa):
    (tmp_path / "s.csv").write_text("spike_time,unit,snr,quality\n0.1,a,4.5,SU\n0.3,a,4.5,SU\n0.2,b,,MU\n0.4,b,,MU\n")
    spikes = read_spikes(tmp_path / "s.csv")
    np.testing.assert_array_equal(spikes.unit_snr, [4.5, np.nan])
    write_csv(spikes, tmp_path / "t.csv")
    assert read_spikes(tmp_path / "t.csv").identical(spikes.assign_attrs(source="t.csv"))
    code, text, err = vibrissa("quality", tmp_path / "s.csv", "--json", "--least-snr", "3", "--need-measured")
    assert json.loads(text)["reason"] == ["", "SNR is not measured"], err
    (tmp_path / "s.csv").write_text("spike_time,unit,snr\n0.1,a,4.5\n0.3,a,5\n")
    code, _, err = vibrissa("quality", tmp_path / "s.csv")
    assert (code, err.count("\n")) == (2, 1)
    assert "line 3, snr must be the same on all lines of a unit" in err


def test_waveforms_of_an_nwb_file_give_the_signal_to_noise(tmp_path, vibrissa):
    pynwb = pytest.importorskip("pynwb")
    from datetime import UTC, datetime

    file = pynwb.NWBFile("s", "i", datetime(2020, 1, 1, tzinfo=UTC))
    shape = np.zeros((40, 2))
    shape[12], shape[20] = (-10.0, -60.0), (5.0, 40.0)
    for k, sd in enumerate((10.0, 5.0)):
        file.add_unit(spike_times=SPREAD, waveform_mean=shape, waveform_sd=np.full((40, 2), sd), id=k)
    with pynwb.NWBHDF5IO(str(tmp_path / "w.nwb"), "w") as io:
        io.write(file)
    _code, text, err = vibrissa("quality", tmp_path / "w.nwb", "--json")
    found = json.loads(text)
    assert found["unit_snr"] == [10.0, 20.0], err
    assert found["snr_source"] == ["mean waveform"] * 2


def test_waveforms_of_a_plexon_file_give_the_signal_to_noise(tmp_path, vibrissa):
    pytest.importorskip("neo")
    ticks, rng = np.round(40_000 * SPREAD).astype(int), np.random.default_rng(0)
    shape = np.interp(np.arange(32), [0, 6, 10, 16, 31], [0, 0, -300, 150, 0])
    waves = np.round(shape + rng.normal(0, 30, (ticks.size, 32)))
    path = write_plx(tmp_path / "w.plx", {(1, 1): ticks, (1, 2): [100_000]}, points=32, waves={(1, 1): waves})
    _code, text, err = vibrissa("quality", path, "--json")
    found = json.loads(text)
    smallest = np.ptp(waves, axis=1).min() / np.sqrt(waves.var(axis=0).mean())
    assert found["unit_snr"] == [pytest.approx(smallest, rel=1e-4), None], err
    assert found["snr_mean"] == [pytest.approx(450 / 30, rel=0.02), None]
    assert found["snr_source"] == ["smallest waveform", ""]
    mean = plexon_waveforms(path, ["1,1"])["unit_waveform"][0]
    np.testing.assert_allclose(
        mean, waves.mean(axis=0) * 3.0 / (2048 * 1e4), rtol=1e-4
    )  # 3 V, 12 bits, gains 1000 and 10


def test_a_real_file_is_judged(vibrissa, tmp_path):
    pytest.importorskip("pynwb")
    if not REAL.is_file():
        pytest.skip("real data A8604-211122.nwb is not here")
    _code, text, _err = vibrissa("quality", REAL, "--json", "--duration", "1087.5289s", "--picture", tmp_path / "q.png")
    found = json.loads(text)
    np.testing.assert_allclose(found["unit_rate"], np.array([11020, 4690, 5644]) / 1087.5289)
    assert found["unit_class"] == ["unlabelled"] * 3
    assert found["kept"] == [True, False, False]
    assert (tmp_path / "q.png").stat().st_size > 10_000


def test_python_says_the_same(phy):
    with pytest.warns(Warning, match="Kept: 1 of 2 good"):
        found = vb.unit_quality(phy)
    assert found.kept.values.tolist() == [True, False, True, False, True]
    with pytest.warns(Warning, match="trials"):
        found = vb.unit_quality({"a": SPREAD}, trials=[(0.0, 10.0), (20.0, 40.0)])
    assert found.time_observed.item() == 30


def test_a_window_without_trials_is_refused_by_the_argument_that_gives_them(phy):
    for units in (phy, {"a": SPREAD}):
        with refusal("conflict", "window") as caught:
            vb.unit_quality(units, window=(0.0, 1.0))
        assert "trials=[(start, stop), …]" in caught.value.remedy
        assert "trial_table" not in str(caught.value)
    with pytest.warns(Warning, match="trials"):
        found = vb.unit_quality({"a": SPREAD}, window=(0.0, 10.0), trials=[0.0, 20.0])
    assert found.time_observed.item() == 20


BAD = {
    "window": (["--window", "0", "1"], "--window must go with trials"),
    "duration": (["--duration", "1s"], "--duration must reach from the first spike to the last"),
    "rule": (["--most-violations", "5"], "--most-violations must be from 0 to 1"),
    "period": (["--refractory-period", "1"], "--refractory-period must have its unit above 0.1 s"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line(name, tmp_path, vibrissa):
    write_csv(spike_table(SPREAD, np.zeros(SPREAD.size, int), ["a"]), tmp_path / "s.csv")
    words, message = BAD[name]
    code, out, err = vibrissa("quality", tmp_path / "s.csv", *words, "--out", tmp_path / "q.nc")
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "q.nc").exists()


TABLES = {
    "word": ("cluster_info.tsv", "cluster_id\tsnr\n3\thigh\n", "line 2, snr must be a finite number"),
    "key": ("cluster_snr.tsv", "unit\tsnr\n3\t4\n", "line 1 must name a column cluster_id beside snr"),
    "cells": ("cluster_snr.tsv", "cluster_id\tsnr\n3\n", "cluster_snr.tsv"),
}


@pytest.mark.parametrize("name", TABLES)
def test_a_malformed_table_of_clusters_is_one_line(name, phy, vibrissa):
    (phy / "cluster_info.tsv").unlink()
    file, text, message = TABLES[name]
    (phy / file).write_text(text)
    code, out, err = vibrissa("quality", phy)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_amplitudes_that_do_not_fit_are_refused(phy, vibrissa):
    np.save(phy / "amplitudes.npy", np.zeros(3))
    code, _, err = vibrissa("quality", phy)
    assert (code, err.count("\n")) == (2, 1)
    assert "amplitudes.npy must hold a number for each of" in err
