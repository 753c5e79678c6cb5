"""Folders of SpikeInterface, read without it: as documented, and as it writes them where it is installed."""

import json
from functools import partial

import numpy as np
import pytest
from refusals import refusal

from vibrissa.neural.io.formats.sorted_folder import read_sorted_folder
from vibrissa.neural.io.recording import recorded_spikes

RATE = 30000.0
SAMPLE, UNIT = [300, 600, 600, 30300], [0, 1, 0, 0]
NAMES = ["a", "b"]


# As its documentation describes them


def numpy_folder(folder, quality=None, segment=(0, 0, 0, 0), **about):
    folder.mkdir(parents=True)
    about = {"sampling_frequency": RATE, "unit_ids": NAMES, "num_segments": 1} | about
    (folder / "numpysorting_info.json").write_text(json.dumps(about))
    fields = [("sample_index", "int64"), ("unit_index", "int64"), ("segment_index", "int64")]
    np.save(folder / "spikes.npy", np.array(list(zip(SAMPLE, UNIT, segment, strict=True)), fields))
    (folder / "properties").mkdir()
    if quality:
        np.save(folder / "properties" / "quality.npy", np.array(quality))
    (folder / "si_folder.json").write_text(json.dumps({"class": "NumpyFolderSorting"}))
    return folder


def npz(path, labels=None, names=NAMES):
    path.parent.mkdir(parents=True)
    labels = np.array(names)[UNIT] if labels is None else labels
    np.savez(
        path,
        unit_ids=names,
        num_segment=[1],
        sampling_frequency=[RATE],
        spike_indexes_seg0=SAMPLE,
        spike_labels_seg0=labels,
    )


def npz_folder(folder, quality=None):
    npz(folder / "sorting_cached.npz")
    (folder / "si_folder.json").write_text(json.dumps({"class": "NpzFolderSorting"}))
    (folder / "properties").mkdir()
    if quality:
        np.save(folder / "properties" / "quality.npy", np.array(quality))
    return folder


def analyzer(folder, quality=None):
    numpy_folder(folder / "sorting", quality)
    (folder / "spikeinterface_info.json").write_text(json.dumps({"object": "SortingAnalyzer"}))
    return folder


def sorter(folder, quality=None, error=False, name="sorting"):
    numpy_folder(folder / "sorter_output" / name, quality)
    (folder / "spikeinterface_log.json").write_text(json.dumps({"sorter_name": "simple", "error": error}))
    return folder


def zarr_folder(folder, quality=None, within=""):
    zarr = pytest.importorskip("zarr", minversion="3", reason="zarr 3 is not installed")
    from numcodecs import Blosc, Delta

    group = zarr.open_group(folder, mode="w", zarr_format=2)
    if within:
        group = group.create_group(within)
    group.attrs.update(sampling_frequency=RATE, num_segments=1)
    put = partial(zarr_array, group, compressors=Blosc("zstd", 5, Blosc.BITSHUFFLE))
    put("unit_ids", NAMES, compressors=None)
    put("spikes/sample_index", SAMPLE, filters=[Delta("int64")])
    put("spikes/unit_index", UNIT)
    put("spikes/segment_slices", [[0, 4]])
    if quality:
        put("properties/quality", quality)
    return folder


def zarr_array(group, name, values, **how):
    values = np.array(values)
    group.create_array(name, shape=values.shape, dtype=values.dtype, chunks=values.shape, **how)[...] = values


BUILT = {
    "sorting": numpy_folder,
    "older sorting": npz_folder,
    "analyzer": analyzer,
    "sorter": sorter,
    "zarr sorting": zarr_folder,
    "zarr analyzer": partial(zarr_folder, within="sorting"),
}
BUILDERS = pytest.mark.parametrize("build", BUILT.values(), ids=BUILT)


def train(table, name):
    return table.spike_time.values[table.spike_unit.values == table.unit_name.values.tolist().index(name)]


@BUILDERS
def test_all_units_are_taken_where_none_is_judged(build, tmp_path):
    found = read_sorted_folder(build(tmp_path / "f"))
    np.testing.assert_array_equal(train(found, "a"), [0.01, 0.02, 1.01])
    np.testing.assert_array_equal(train(found, "b"), [0.02])
    assert found.attrs["sampling_rate"] == RATE
    assert found.attrs["source"] == "f"
    assert "all 2 units are taken" in found.attrs["remark"]
    with refusal("missing", "f"):
        read_sorted_folder(tmp_path / "f", groups=("mua",))


@BUILDERS
def test_units_that_were_judged_are_chosen_by_their_group(build, tmp_path):
    found = read_sorted_folder(build(tmp_path / "f", ["good", "noise"]))
    assert found.unit_name.values.tolist() == ["a"]
    assert found.unit_quality.values.tolist() == ["SU"]
    assert found.attrs["remark"] == "1 units are good; 1 others are left out"
    both = read_sorted_folder(tmp_path / "f", groups=("good", "noise"))
    assert both.unit_name.values.tolist() == NAMES
    assert "unit_quality" not in both
    with refusal("too-few", "f"):
        read_sorted_folder(tmp_path / "f", groups=("mua",))


def test_numbers_of_units_in_any_order_are_labels_of_an_npz(tmp_path):
    npz(tmp_path / "f" / "firings.npz", names=[7, 3])
    (tmp_path / "f" / "spikeinterface_log.json").write_text("{}")
    found = read_sorted_folder(tmp_path / "f")
    np.testing.assert_array_equal(train(found, "7"), [0.01, 0.02, 1.01])
    np.testing.assert_array_equal(train(found, "3"), [0.02])


def test_phy_within_the_output_of_a_sorter_is_read_as_phy(tmp_path):
    inner = tmp_path / "f" / "sorter_output"
    inner.mkdir(parents=True)
    (tmp_path / "f" / "spikeinterface_log.json").write_text(json.dumps({"sorter_name": "kilosort4", "error": False}))
    np.save(inner / "spike_times.npy", SAMPLE)
    np.save(inner / "spike_clusters.npy", UNIT)
    (inner / "params.py").write_text(f"sample_rate = {RATE}\n")
    (inner / "cluster_KSLabel.tsv").write_text("cluster_id\tKSLabel\n0\tgood\n1\tmua\n")
    found = read_sorted_folder(tmp_path / "f")
    np.testing.assert_array_equal(train(found, "0"), [0.01, 0.02, 1.01])
    assert found.attrs["remark"].startswith("1 clusters are units, good by cluster_KSLabel.tsv")


def test_trials_are_cut_from_it(tmp_path):
    (tmp_path / "t.csv").write_text("start,stop\n0,0.5\n1,1.5\n")
    found, count = recorded_spikes(numpy_folder(tmp_path / "f"), window=(0.0, 0.5), trials=tmp_path / "t.csv")
    np.testing.assert_allclose(np.sort(found.spike_time), [0.01, 0.01, 0.02, 0.02])
    assert count == 2


def without(folder, name):
    (folder / name).unlink()
    return folder


def empty(folder):
    numpy_folder(folder, unit_ids=[])
    np.save(folder / "spikes.npy", np.load(folder / "spikes.npy")[:0])
    return folder


def objects(folder):
    np.save(numpy_folder(folder) / "properties" / "quality.npy", np.array(["good", None], object), allow_pickle=True)
    return folder


def strangers(folder):
    npz(folder / "sorting_cached.npz", labels=np.array(["a", "b", "c", "a"]))
    return folder


def holding(folder, kind):
    folder.mkdir()
    (folder / "si_folder.json").write_text(json.dumps({"class": kind}))
    return folder


def of_a_sorter(folder, *names):
    for name in names:
        numpy_folder(folder / "sorter_output" / name)
    (folder / "sorter_output").mkdir(parents=True, exist_ok=True)
    (folder / "spikeinterface_log.json").write_text(json.dumps({"sorter_name": "tridesclous", "error": False}))
    return folder


BAD = {
    "no spikes": (lambda f: without(numpy_folder(f), "spikes.npy"), "missing", "spikes.npy"),
    "no rate": (lambda f: numpy_folder(f, sampling_frequency=0), "range", "f, sampling_frequency"),
    "few names": (lambda f: numpy_folder(f, unit_ids=["a"]), "range", "f"),
    "two stretches": (lambda f: numpy_folder(f, segment=(0, 0, 1, 1), num_segments=2), "shape", "f"),
    "no units": (empty, "too-few", "f"),
    "label of two": (lambda f: numpy_folder(f, ["good"]), "shape", "f, quality"),
    "labels that are objects": (objects, "format", "quality.npy"),
    "label of no unit": (strangers, "format", "sorting_cached.npz"),
    "recording": (lambda f: holding(f, "BinaryFolderRecording"), "too-few", "f"),
    "another kind": (lambda f: holding(f, "AggregateSorting"), "format", "f"),
    "a sorter that failed": (lambda f: sorter(f, error=True), "missing", "f"),
    "a sorter of its own format": (of_a_sorter, "missing", "f"),
    "two sortings": (lambda f: of_a_sorter(f, "one", "two"), "missing", "f"),
}


@pytest.mark.parametrize(("build", "code", "quantity"), BAD.values(), ids=BAD)
def test_a_bad_folder_is_one_line(build, code, quantity, tmp_path):
    with refusal(code, quantity):
        read_sorted_folder(build(tmp_path / "f"))


def test_folders_of_other_kinds_are_refused(tmp_path):
    (tmp_path / "f").mkdir()
    for content in (None, "{}", "[]", "{"):
        if content:
            (tmp_path / "f" / "si_folder.json").write_text(content)
        with refusal("format", "si_folder.json" if content in ("[]", "{") else "f"):
            recorded_spikes(tmp_path / "f", window=(0.0, 0.5), trials=tmp_path / "t.csv")


# As it writes them


def their_sorting(quality=None):
    core = pytest.importorskip("spikeinterface.core", reason="the extra sorting is not installed")
    found = core.NumpySorting.from_samples_and_labels([np.array(SAMPLE)], [np.array(UNIT)], RATE, unit_ids=NAMES)
    if quality:
        found.set_property("quality", quality)
    return found


def their_analyzer(folder, quality, form):
    core = pytest.importorskip("spikeinterface.core", reason="the extra sorting is not installed")
    traces = core.generate_recording(num_channels=2, durations=[2.0], sampling_frequency=RATE, seed=0)
    core.create_sorting_analyzer(their_sorting(quality), traces, format=form, folder=folder, sparse=False)


WROTE = {
    "sorting": lambda folder, quality: their_sorting(quality).save(folder=folder),
    "older sorting": lambda folder, quality: their_sorting(quality).save(folder=folder, format="npz_folder"),
    "zarr sorting": lambda folder, quality: their_sorting(quality).save(folder=folder, format="zarr"),
    "analyzer": lambda folder, quality: their_analyzer(folder, quality, "binary_folder"),
    "zarr analyzer": lambda folder, quality: their_analyzer(folder, quality, "zarr"),
}


@pytest.mark.filterwarnings("ignore")  # of theirs while it writes
@pytest.mark.parametrize("quality", [None, ["good", "mua"]], ids=["unjudged", "judged"])
@pytest.mark.parametrize("kind", WROTE)
def test_what_spikeinterface_wrote_is_read_as_it_reads_it(kind, quality, tmp_path):
    core = pytest.importorskip("spikeinterface.core", reason="the extra sorting is not installed")
    folder = tmp_path / ("f.zarr" if kind.startswith("zarr") else "f")
    WROTE[kind](folder, quality)
    theirs = core.load(folder)
    theirs = getattr(theirs, "sorting", theirs)
    ours = read_sorted_folder(folder, groups=("good", "mua") if quality else ("good",))
    assert ours.unit_name.values.tolist() == [str(name) for name in theirs.unit_ids]
    for name in theirs.unit_ids:
        np.testing.assert_array_equal(np.round(train(ours, str(name)) * RATE), theirs.get_unit_spike_train(name))
    assert ("unit_quality" in ours) == (quality is not None)
