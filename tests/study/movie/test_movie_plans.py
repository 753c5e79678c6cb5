"""What can be refused or remarked of a movie is so before its frames are looked at."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.study.movie import track_plan
from vibrissa.study.movie.track_plan import plan_tracking
from vibrissa.study.spec.settings import MovieFile


def planned(path, **how):
    movie = MovieFile(path=path.name, frame_rate=500.0, pixel_size=1e-4, tracking="link", **how)
    return plan_tracking(movie, path.parent)


@pytest.mark.parametrize("region", [(0, 0, 400, 100), (0, 0, 100, 240)])
def test_a_region_off_the_image_is_refused_before_the_movie_is_looked_at(tmp_path, monkeypatch, region):
    monkeypatch.setattr(track_plan, "choose_way", lambda *_, **__: pytest.fail("the movie was looked at"))
    np.save(tmp_path / "m.npy", np.zeros((3, 240, 320), np.uint8))
    with refusal("range", "region", str(region)) as caught:
        planned(tmp_path / "m.npy", region=region)
    assert caught.value.rule == "must lie within the image of 320 × 240 pixels"
    assert "right and bottom are the larger ones" in caught.value.remedy


@pytest.mark.parametrize(
    ("shape", "said"),
    [((240, 320, 40), True), ((40, 240, 320), False), ((40, 240, 40), False), ((400, 40, 320), False)],
)
def test_an_array_whose_last_axis_may_be_that_of_frames_is_remarked(tmp_path, shape, said):
    path = tmp_path / "m.npy"
    np.save(path, np.zeros(shape, np.uint8))
    remarks = [line for line in planned(path).remarks if "axes" in line]
    read, remedy = "240 frames of 40 columns and 320 rows", "save it with axes (frames, rows, columns)"
    line = f"m.npy is read as {read}: if its last axis is that of the frames, {remedy}"
    assert remarks == ([line] if said else [])
