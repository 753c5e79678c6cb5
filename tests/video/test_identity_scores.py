"""The scores of ``benchmarks/identity_scores.py``: trackers whose faults are known get what they deserve, exactly."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from vibrissa.quantities import dataset

FRAMES, WHISKERS, POINTS, CROSSING = 100, 4, 101, 30


@pytest.fixture(scope="module")
def bench():
    """Give the scores as a module."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
        yield importlib.import_module("identity_scores")


def rows():
    """(whisker, frame): whiskers 0 and 1 pass through one another at frame 30; the others keep apart."""
    t = np.arange(FRAMES) - CROSSING
    return np.stack([100.0 + 3 * t, 100.0 - 3 * t, np.full(FRAMES, 400.0), np.full(FRAMES, 450.0)])


def segments(offset=0.0, keep=None, name=None, probability=None):
    """Straight level lines, one for each whisker and frame that is kept."""
    keep = np.ones((WHISKERS, FRAMES), bool) if keep is None else keep
    name = np.broadcast_to(np.arange(WHISKERS)[:, None], keep.shape) if name is None else name
    frame, who = np.nonzero(keep.T)
    lines = rows()[who, frame]
    more = {} if probability is None else {"segment_probability": probability[who, frame]}
    size = frame.size * POINTS
    return dataset(
        {"frames": FRAMES, "width": 640, "height": 480, "source": "test"},
        segment_frame=frame,
        segment_start=POINTS * np.arange(frame.size),
        segment_whisker=name[who, frame],
        column=np.tile(np.arange(POINTS) + 50.0, frame.size),
        row=np.repeat(lines, POINTS) + offset,
        line_width=np.full(size, 2.0),
        line_contrast=np.full(size, 30.0),
        position_sd=np.full(size, 0.1),
        **more,
    )


def score(bench, found):
    return bench.score(bench.lines_of(found), segments(), 3.0)


def test_a_perfect_tracker_is_perfect(bench):
    found = score(bench, segments())
    assert found["recall"] == found["followed"] == found["worst"] == 1
    assert found["error_95"] == found["astray"] == found["switches"] == found["wrong"] == 0
    assert found["names"] == WHISKERS


def test_names_do_not_matter_only_that_they_stay(bench):
    name = np.broadcast_to(np.array([7, 2, 9, 0])[:, None], (WHISKERS, FRAMES))
    assert score(bench, segments(name=name)) == score(bench, segments())


def swapped(frame=CROSSING):
    name = np.repeat(np.arange(WHISKERS)[:, None], FRAMES, axis=1)
    name[[0, 1], frame:] = name[[1, 0], frame:]
    return name


def test_a_name_for_a_hair_is_counted_and_nothing_is_wrong(bench):
    """The lowest line is no whisker of the truth."""
    truth = segments(keep=np.arange(WHISKERS)[:, None] + np.zeros(FRAMES, int) < WHISKERS - 1)
    probability = np.full((WHISKERS, FRAMES), 0.8)
    found = bench.score(bench.lines_of(segments(probability=probability)), truth, 3.0)
    assert (found["names"], found["hairs"], found["wrong"]) == (WHISKERS, 1, 0)
    assert found["astray"] == pytest.approx(1 / WHISKERS)
    assert found["claims_80"] == found["right_80"] == (WHISKERS - 1) * FRAMES


def test_two_whiskers_that_swap_at_their_crossing_are_right_in_the_longer_part(bench):
    """At the crossing itself either name is right: 70 of 100 frames after it, and the one of the crossing."""
    found = score(bench, segments(name=swapped()))
    assert found["switches"] == 1000 * 2 / FRAMES
    assert found["followed"] == pytest.approx((2 * 0.70 + 2) / WHISKERS)
    assert found["worst"] == 0.70
    assert found["wrong"] == pytest.approx(1000 * 2 * CROSSING / (WHISKERS * FRAMES))
    assert found["recall"] == 1
    assert found["allowed"] == 1


def test_a_swap_back_counts_again(bench):
    name = swapped()
    name[[0, 1], 60:] = name[[1, 0], 60:]
    found = score(bench, segments(name=name))
    assert found["switches"] == 1000 * 4 / FRAMES
    assert found["wrong"] == pytest.approx(1000 * 2 * (60 - CROSSING - 1) / (WHISKERS * FRAMES))  # not the crossing


@pytest.mark.parametrize("shift", [0.3, -0.3])
def test_a_shift_is_the_error_and_nothing_else(bench, shift):
    found = score(bench, segments(offset=shift))
    assert found["error"] == pytest.approx(0.3)
    assert found["error_95"] == pytest.approx(0.3)
    assert found["recall"] == found["followed"] == 1


def test_a_shift_beyond_two_pixels_finds_nothing(bench):
    found = score(bench, segments(offset=np.where(np.arange(WHISKERS * FRAMES * POINTS) >= 0, 2.5, 0)))
    assert found["recall"] < 0.02  # where a crossing line happens to pass
    assert found["astray"] > 0.98


def test_frames_that_are_dropped_are_not_followed_and_not_wrong(bench):
    keep = np.ones((WHISKERS, FRAMES), bool)
    for whisker in range(WHISKERS):
        keep[whisker, 5 + whisker :: 10] = False
    keep[0, CROSSING] = keep[1, CROSSING] = True  # there one line would cover both
    found = score(bench, segments(keep=keep))
    assert found["recall"] == found["followed"] == keep.mean() == 0.9
    assert found["allowed"] == 0.9
    assert found["switches"] == found["wrong"] == found["astray"] == 0


def test_a_whisker_that_comes_back_under_a_new_name_is_a_switch(bench):
    name = np.repeat(np.arange(WHISKERS)[:, None], FRAMES, axis=1)
    name[3, 80:] = WHISKERS
    found = score(bench, segments(name=name))
    assert found["switches"] == 1000 / FRAMES
    assert found["worst"] == 0.8
    assert found["wrong"] == pytest.approx(1000 * 20 / (WHISKERS * FRAMES))
    assert found["names"] == WHISKERS + 1


def test_one_line_for_two_whiskers_can_be_both(bench):
    """At the crossing one segment is given to both whiskers, as a linker does that knows that they coincide."""
    keep = np.ones((WHISKERS, FRAMES), bool)
    keep[1, CROSSING] = False
    found = segments(keep=keep)
    other = np.full(found.sizes["segment"], -1)
    other[(found.segment_frame.values == CROSSING) & (found.segment_whisker.values == 0)] = 1
    identity = dataset(segment_whisker=found.segment_whisker.values).assign(segment_other=("segment", other))
    assert bench.score(bench.lines_of(found, identity), segments(), 3.0)["followed"] == 1
    assert score(bench, found)["followed"] == pytest.approx(1 - 1 / (WHISKERS * FRAMES))


def test_confidence_that_is_what_it_says_is_counted_in_its_bin(bench):
    """Names wrong in 30 of 100 frames of two whiskers, which are called 0.75 sure; the others 0.97."""
    probability = np.full((WHISKERS, FRAMES), 0.97)
    probability[:2] = 0.75
    found = score(bench, segments(name=swapped(), probability=probability))
    assert (found["claims_70"], found["right_70"]) == (2 * FRAMES, 2 * (FRAMES - CROSSING))
    assert found["sure_70"] == pytest.approx(0.75 * 2 * FRAMES)
    assert found["claims_95"] == found["right_95"] == 2 * FRAMES
    assert sum(found[f"claims_{100 * low:.0f}"] for low in bench.BINS) == WHISKERS * FRAMES


def test_a_line_that_goes_over_to_another_whisker_is_neithers(bench):
    found = segments()
    frame, start = found.segment_frame.values, found.segment_start.values
    row = found.row.values.copy()
    for k in np.flatnonzero((found.segment_whisker.values == 2) & (frame >= 50)):
        row[start[k] + POINTS // 2 : start[k] + POINTS] = 450.0
    found["row"] = ("point", row)
    scored = score(bench, found)
    assert scored["worst"] == 0.5
    assert scored["wrong"] == pytest.approx(1000 * 50 / (WHISKERS * FRAMES))


def test_faint_tips_need_not_be_found(bench):
    truth = segments()
    truth["line_contrast"] = ("point", np.where(truth.column.values > 100, 1.0, 30.0))
    found = segments()
    short = found.column.values <= 100
    found = found.isel(point=short).assign(segment_start=("segment", 51 * np.arange(found.sizes["segment"])))
    assert bench.score(bench.lines_of(found), truth, 3.0)["recall"] == 1
    assert bench.score(bench.lines_of(found), truth, 0.5)["recall"] == pytest.approx(53 / 101)  # and two beside the end
