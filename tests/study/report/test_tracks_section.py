"""The report's table of tracks: how far each whisker was followed, and why frames were lost, where that is known."""

import json

import numpy as np

from vibrissa.quantities import dataset
from vibrissa.study.report.report import _tracks


def profile(**attrs):
    """Two whiskers of ten frames."""
    x = np.broadcast_to(np.linspace(0, 0.02, 6), (2, 10, 6))
    own = {"whisker": np.arange(2), "time": np.arange(10) / 500, "node": np.arange(6)}
    return dataset(attrs, lead=("whisker",), **own, x=x, y=x, arc_length=x[:, 0])


def test_reasons_of_lost_frames_are_listed_by_whisker():
    lost = json.dumps([[], [[3, 5, "too faint"], [8, 8, "hidden"]]])
    assert [row["lost"] for row in _tracks(profile(lost=lost))] == [[], ["3–5: too faint", "8: hidden"]]


def test_tracks_of_other_programs_have_no_reasons():
    rows = _tracks(profile())
    assert [row["lost"] for row in rows] == [[], []]
    assert [row["followed"] for row in rows] == ["10 of 10"] * 2
    assert [row["sd"] for row in rows] == ["not known"] * 2
