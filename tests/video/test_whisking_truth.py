"""``benchmarks/whisking_truth.py``: its movies hold what they are for, and a run that was stopped goes on."""

import dataclasses
import importlib
from pathlib import Path

import numpy as np
import pytest

from vibrissa.video.camera.camera import exposure_times
from vibrissa.video.camera.pad.curves import scene_curves
from vibrissa.video.camera.pad.truth import scene_truth


@pytest.fixture(scope="module")
def bench():
    """Give the modules of the benchmark by name."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
        names = ("whisking_truth", "whisking_movies", "whisking_trackers", "identity_scores")
        yield {name: importlib.import_module(name) for name in names}


@pytest.mark.parametrize("seed", range(4))
def test_pole_scenes_have_touches_and_free_frames(bench, seed):
    scene = bench["whisking_movies"].scene_of("pole", seed)
    curves = scene_curves(scene, exposure_times(scene.camera, 300))
    assert 10 < curves.touching.sum() < 2 * 290
    assert not curves.touching[2:].any()
    gap = np.hypot(curves.x - scene.pole.position[0], curves.y - scene.pole.position[1])[:2].min(axis=2)
    assert gap[curves.touching[:2]].max() < 1.2 * scene.pole.radius


def test_a_paw_hides_a_part_for_some_frames(bench):
    scene = bench["whisking_movies"].scene_of("paw", 1)
    camera = dataclasses.replace(scene.camera, frame_rate=40.0)  # a coarse look at the same 0.6 s
    scene = dataclasses.replace(scene, camera=camera)
    shown = scene_truth(scene, 24).profile.node_visible.values.sum(axis=(0, 2))
    free = scene_truth(dataclasses.replace(scene, paw=None), 24).profile.node_visible.values.sum(axis=(0, 2))
    assert (shown <= free).all()
    assert 3 <= np.count_nonzero(shown < free) < 15
    assert (shown / free).min() < 0.85


def test_whiskers_of_both_pads_cross(bench):
    """Somewhere between base and tip each pad's whiskers change their order."""
    scene = bench["whisking_movies"].scene_of("two_pads", 0)
    curves = scene_curves(scene, exposure_times(scene.camera, 120))
    for pad in (slice(0, 12), slice(12, 24)):
        order = np.argsort(curves.y[pad, :, 60], axis=0)
        assert len(np.unique(order, axis=1).T) > 10


def perfect(truth):
    """Give a tracker that knows the truth."""

    def track(frames, scene):
        return truth.lines_of(scene_truth(scene, len(frames)).segments)

    return track


def test_a_stopped_run_goes_on_and_a_perfect_tracker_has_perfect_scores(bench, tmp_path, capsys):
    truth, trackers = bench["whisking_truth"], {"perfect": perfect(bench["identity_scores"])}
    assert truth.missing(tmp_path, "one_row", 2, trackers) == [(0, ["perfect"]), (1, ["perfect"])]
    truth.run(tmp_path, "one_row", 0, 4, trackers)
    assert truth.missing(tmp_path, "one_row", 2, trackers) == [(1, ["perfect"])]
    assert truth.missing(tmp_path, "one_row", 1, {**trackers, "other": None}) == [(0, ["other"])]
    (row,) = truth.stored(tmp_path, "one_row")
    assert float(row["recall"]) == float(row["followed"]) == 1
    assert float(row["wrong"]) == float(row["switches"]) == float(row["astray"]) == 0
    assert float(row["error_95"]) < 1e-6
    truth.tables(tmp_path)
    assert "| one_row | perfect | 1 | 1.000 |" in capsys.readouterr().out


def test_without_whisk_it_is_skipped_with_a_message(bench, tmp_path, capsys):
    assert bench["whisking_trackers"].whisk_tracker(tmp_path) is None
    assert "WHISK" in capsys.readouterr().err
