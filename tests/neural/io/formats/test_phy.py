"""Folders of phy: who is a unit, by whose word, and what is left out; nothing in them is run."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.neural.io.formats.phy import read_phy
from vibrissa.neural.io.recording import recorded_spikes

PARAMS = "dat_path = 'recording.dat'\nn_channels_dat = 8\ndtype = 'int16'\noffset = 0\nsample_rate = 30000.\n"


@pytest.fixture
def phy(tmp_path):
    """Clusters 3 (good), 5 (mua), 8 (noise), 9 (never judged); each fires at its number in ms, and 1 s later."""
    clusters = np.tile([3, 5, 8, 9], 2)
    np.save(tmp_path / "spike_times.npy", (30 * clusters + np.repeat([0, 30000], 4)).astype(np.uint64)[:, None])
    np.save(tmp_path / "spike_clusters.npy", clusters.astype(np.int32))
    (tmp_path / "params.py").write_text(PARAMS)
    (tmp_path / "cluster_group.tsv").write_text("cluster_id\tgroup\n3\tgood\n5\tmua\n8\tnoise\n")
    return tmp_path


def test_the_good_ones_are_units_and_the_rest_is_told(phy):
    found = read_phy(phy)
    assert found.unit_name.values.tolist() == ["3"]
    assert found.unit_quality.values.tolist() == ["SU"]
    np.testing.assert_allclose(found.spike_time, [0.003, 1.003])
    told = "1 clusters are units, good by cluster_group.tsv; 3 clusters with 6 spikes are left out"
    assert found.attrs["remark"] == told


def test_other_groups_are_taken_when_asked_for(phy):
    found = read_phy(phy, groups=("good", "mua"))
    assert found.unit_quality.values.tolist() == ["SU", "MU"]
    found = read_phy(phy, groups=("good", "mua", "noise", "unsorted"))
    assert found.unit_id.values.tolist() == [3, 5, 8, 9]
    assert "unit_quality" not in found
    assert "left out" not in found.attrs["remark"]


def test_the_sorter_s_own_labels_stand_in_where_no_one_has_judged(phy):
    (phy / "cluster_group.tsv").unlink()
    with refusal("format", "test_the_sorter_s_own_labels_s0"):
        read_phy(phy)
    (phy / "cluster_KSLabel.tsv").write_text("cluster_id\tKSLabel\n3\tmua\n5\tgood\n8\tgood\n9\tmua\n")
    found = read_phy(phy)
    assert found.unit_id.values.tolist() == [5, 8]
    assert "good by cluster_KSLabel.tsv" in found.attrs["remark"]


def test_cluster_info_serves_too(phy):
    (phy / "cluster_group.tsv").unlink()
    (phy / "cluster_info.tsv").write_text("cluster_id\tamp\tgroup\tch\n3\t1.0\tnoise\t2\n5\t2.0\tgood\t1\n8\t1\t\t4\n")
    assert read_phy(phy).unit_id.values.tolist() == [5]
    assert read_phy(phy, groups=("unsorted",)).unit_id.values.tolist() == [8, 9]


def test_params_are_read_and_never_run(phy):
    (phy / "params.py").write_text("import os\nos.remove('spike_times.npy')\n" + PARAMS)
    assert read_phy(phy).sizes["unit"] == 1
    (phy / "params.py").write_text("sample_rate = float(open('/etc/hostname').read())\n")
    with refusal("range", "params.py, sample_rate"):
        read_phy(phy)


def test_spikes_are_cut_into_the_trials_of_a_table(phy):
    (phy / "trials.csv").write_text("start,stop\n0,0.5\n1,1.5\n")
    found, count = recorded_spikes(phy, window=(0.0, 0.5), trials=phy / "trials.csv", groups=("good", "mua"))
    assert count == 2
    np.testing.assert_allclose(found.spike_time, [0.003, 0.003, 0.005, 0.005])
    with refusal("missing", "test_spikes_are_cut_into_the_t0"):
        recorded_spikes(phy, window=(0.0, 0.5))


def array(folder, name, values):
    np.save(folder / name, np.array(values))


BAD = {
    "no params": (lambda f: (f / "params.py").unlink(), ("missing", "params.py")),
    "no rate": (
        lambda f: (f / "params.py").write_text("x = 1\n"),
        ("format", "params.py"),
        "must have a line sample_rate",
    ),
    "no python": (
        lambda f: (f / "params.py").write_text("sample rate = 3\n"),
        ("format", "params.py"),
        "must be lines like",
    ),
    "rate 0": (lambda f: (f / "params.py").write_text("sample_rate = 0\n"), ("range", "params.py, sample_rate", "0")),
    "binary params": (
        lambda f: (f / "params.py").write_bytes(b"\x00\xff\xfe"),
        ("format", "params.py"),
        "must be text",
    ),
    "no clusters": (lambda f: (f / "spike_clusters.npy").unlink(), ("missing", "spike_templates.npy")),
    "lengths": (lambda f: array(f, "spike_clusters.npy", [1, 2]), ("shape", None, "8 spikes, 2 clusters")),
    "no spike": (
        lambda f: (array(f, "spike_times.npy", []), array(f, "spike_clusters.npy", [])),
        ("too-few", None, "0"),
    ),
    "seconds": (
        lambda f: array(f, "spike_times.npy", np.arange(8) * 0.1),
        ("too-few", "spike_times.npy", "float64 (8,)"),
    ),
    "negative": (lambda f: array(f, "spike_times.npy", np.arange(8) - 3), ("too-few", "spike_times.npy", "int64 (8,)")),
    "not finite": (lambda f: array(f, "spike_times.npy", [np.nan] * 8), ("too-few", "spike_times.npy", "float64 (8,)")),
    "text": (lambda f: array(f, "spike_times.npy", ["a"] * 8), ("too-few", "spike_times.npy", "<U1 (8,)")),
    "two columns": (
        lambda f: array(f, "spike_times.npy", np.ones((8, 2))),
        ("too-few", "spike_times.npy", "float64 (8, 2)"),
    ),
    "pickle": (
        lambda f: np.save(f / "spike_times.npy", np.array([{}] * 8), allow_pickle=True),
        ("format", "spike_times.npy"),
        "must be a whole array of NumPy, without Python objects",
    ),
    "truncated": (
        lambda f: (f / "spike_times.npy").write_bytes(b"\x93NUMPY\x01"),
        ("format", "spike_times.npy"),
        "must be a whole array of NumPy, without Python objects",
    ),
    "labels": (
        lambda f: (f / "cluster_group.tsv").write_text("cluster_id\tgroup\nx\tgood\n"),
        ("format", "cluster_group.tsv, line 2, cluster_id", "'x'"),
    ),
    "header": (
        lambda f: (f / "cluster_group.tsv").write_text("a,b\n3,good\n"),
        ("format", "cluster_group.tsv, line 1", "('a,b',)"),
    ),
    "short line": (
        lambda f: (f / "cluster_group.tsv").write_text("cluster_id\tgroup\n3\n"),
        ("shape", "cluster_group.tsv, line 2", "1"),
    ),
    "empty": (lambda f: (f / "cluster_group.tsv").write_text(""), ("too-few", "cluster_group.tsv", "an empty file")),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_folder_is_one_line(name, phy):
    spoil, fields, *rule = BAD[name]
    spoil(phy)
    with refusal(*fields) as caught:
        read_phy(phy)
    assert all(part in caught.value.rule for part in rule)


def test_spikeinterface_reads_the_same_clusters(phy):
    extractors = pytest.importorskip("spikeinterface.extractors", reason="the extra sorting is not installed")
    found = read_phy(phy, groups=("good", "mua", "noise"))
    other = extractors.read_phy(phy)
    for k, cluster in enumerate(found.unit_id.values.tolist()):
        own = found.spike_time.values[found.spike_unit.values == k]
        np.testing.assert_array_equal(np.round(own * 30000), other.get_unit_spike_train(cluster))
    assert other.get_property("quality").tolist() == ["good", "mua", "noise"]
