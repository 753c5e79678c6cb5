"""Results on disk: round trip, equal bytes, whole or not at all."""

import os
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from vibrissa.files import digest, held, written_whole
from vibrissa.netcdf import encoded, load, save
from vibrissa.quantities import dataset


def result():
    return dataset(
        {"method": "least-squares", "n_trials": 3, "friction": 0.4},
        time=np.arange(50) / 1500,
        mode=[1, 2],
        mode_amplitude=np.random.default_rng(1).normal(size=(2, 50)),
        contact=0.29,
        kappa=[1.0, np.nan],
        spike_time=[0.1, 0.2, 0.3],
        spike_trial=[0, 0, 2],
    )


def test_what_is_saved_is_loaded(tmp_path):
    save(result(), tmp_path / "result.nc")
    assert load(tmp_path / "result.nc").identical(result())


def test_large_results_are_compressed_without_loss(tmp_path):
    t = np.arange(20_000) / 20_000
    wave = np.sin(700 * t) * np.exp(-40 * t)
    wave[:5] = np.nan
    data = dataset(time=t, mode=[1, 2], mode_amplitude=np.array([wave, 1e-3 * wave]))
    save(data, tmp_path / "wave.nc")
    again = load(tmp_path / "wave.nc")
    assert again.identical(data)
    assert (tmp_path / "wave.nc").stat().st_size < 0.85 * data.nbytes


def test_a_result_that_was_read_gives_the_bytes_of_one_that_was_computed(tmp_path):
    data = dataset(time=np.arange(5000) / 500, mode=[1], mode_amplitude=np.ones((1, 5000)))
    save(data, tmp_path / "one.nc")
    assert encoded(load(tmp_path / "one.nc")) == encoded(data)
    assert encoded(load(tmp_path / "one.nc").isel(time=slice(10))) == encoded(data.isel(time=slice(10)))


def test_nothing_spiked_is_loaded_as_nothing(tmp_path):
    silent = dataset(spike_time=np.zeros(0), spike_trial=np.zeros(0, int))
    save(silent, tmp_path / "silent.nc")
    assert load(tmp_path / "silent.nc").identical(silent)


def test_equal_results_give_equal_bytes(tmp_path):
    save(result(), tmp_path / "one.nc")
    time.sleep(1.1)  # a clock in the file would show
    save(result(), tmp_path / "two.nc")
    assert (tmp_path / "one.nc").read_bytes() == (tmp_path / "two.nc").read_bytes()


def test_bytes_are_equal_under_a_profiler_that_holds_what_it_sees(tmp_path):
    """As Dask's does in every worker; without a thread of its own one file in ten had another layout."""
    seen, done, mine = [], threading.Event(), threading.get_ident()

    def look():
        while not done.is_set():
            seen.append(sys._current_frames().get(mine))
            time.sleep(1e-3)
            seen[:-3] = []

    watcher = threading.Thread(target=look)
    watcher.start()
    try:
        found = {encoded(result()) for _ in range(150)}
    finally:
        done.set()
        watcher.join()
    assert len(found) == 1


def test_a_result_replaces_the_one_before(tmp_path):
    save(dataset(contact=0.1), tmp_path / "result.nc")
    save(dataset(contact=0.2), tmp_path / "result.nc")
    assert float(load(tmp_path / "result.nc").contact) == 0.2
    assert os.listdir(tmp_path) == ["result.nc"]


def test_full_disk_leaves_what_was_there(tmp_path, monkeypatch):
    target = tmp_path / "result.nc"
    save(dataset(contact=0.1), target)
    before = target.read_bytes()

    def full(self, data):
        with self.open("wb") as file:
            file.write(data[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with refusal("machine", "result.nc"):
        save(dataset(contact=0.2), target)
    assert target.read_bytes() == before
    assert os.listdir(tmp_path) == ["result.nc"]


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_failure_of_any_kind_leaves_no_half_file(tmp_path, failure):
    def interrupted():
        with written_whole(tmp_path / "picture.png") as temporary:
            assert temporary.suffix == ".png"
            temporary.write_bytes(b"half")
            raise failure

    with pytest.raises(failure):
        interrupted()
    assert os.listdir(tmp_path) == []


def test_missing_folder_is_told_with_its_remedy(tmp_path):
    with refusal("missing", "nowhere"):
        save(dataset(contact=0.1), tmp_path / "nowhere" / "result.nc")


def test_folder_in_the_place_of_the_result_is_refused(tmp_path):
    (tmp_path / "result.nc").mkdir()
    with refusal("machine", "result.nc"):
        save(dataset(contact=0.1), tmp_path / "result.nc")
    assert os.listdir(tmp_path) == ["result.nc"]


def test_missing_file_is_told(tmp_path):
    with refusal("missing", "absent.nc"):
        load(tmp_path / "absent.nc")


@pytest.mark.parametrize("content", [b"", b"time,x\n0,1\n", b"\x89HDF\r\n\x1a\n" + bytes(100)])
def test_files_that_are_no_netcdf_are_told(tmp_path, content):
    (tmp_path / "other.nc").write_bytes(content)
    with refusal("format", "other.nc") as failure:
        load(tmp_path / "other.nc")
    assert "\n" not in str(failure.value)


def test_truncated_result_is_told(tmp_path):
    save(result(), tmp_path / "result.nc")
    whole = (tmp_path / "result.nc").read_bytes()
    (tmp_path / "result.nc").write_bytes(whole[: len(whole) // 2])
    with refusal("format", "result.nc"):
        load(tmp_path / "result.nc")


def test_results_on_a_mounted_disk_are_made_on_it(tmp_path, monkeypatch):
    out = tmp_path / "out"
    out.mkdir()
    monkeypatch.setattr(Path, "is_mount", lambda self: self == out)
    with held(out) as work:
        assert work.parent == out
        assert sorted(one.name for one in tmp_path.iterdir()) == ["out"]
    assert list(out.iterdir()) == []


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc, in which no file can be made")
def test_a_folder_that_cannot_be_made_is_not_said_to_be_in_use():
    with refusal("missing", "/proc/out") as caught, held("/proc/out"):
        pass
    assert "must lie where files can be made" in str(caught.value)


def test_the_digest_of_a_folder_is_of_all_files_below_it(tmp_path):
    (tmp_path / "sorting").mkdir()
    inner = tmp_path / "sorting" / "units.json"
    inner.write_text("1")
    before = digest(tmp_path)
    inner.write_text("2")
    assert digest(tmp_path) != before


def test_two_threads_may_write_one_file(tmp_path):
    def write(content):
        for _ in range(50):
            with written_whole(tmp_path / "f.txt") as temporary:
                temporary.write_text(content)

    with ThreadPoolExecutor(2) as pool:
        for one in [pool.submit(write, letter * 1000) for letter in "ab"]:
            one.result()
    assert (tmp_path / "f.txt").read_text() in ("a" * 1000, "b" * 1000)
    assert os.listdir(tmp_path) == ["f.txt"]
