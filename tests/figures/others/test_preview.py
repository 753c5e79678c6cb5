"""The preview shows what was tracked, where it was tracked, in the frames that were asked for."""

import json

import av
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from refusals import refusal

from vibrissa.figures.colours import rgb
from vibrissa.figures.others import preview
from vibrissa.figures.others.text_strip import TEXT
from vibrissa.quantities import dataset
from vibrissa.video.io.colour import write_colour

PIXEL, FRAMES, HEIGHT, WIDTH = 1e-4, 9, 60, 91


@pytest.fixture
def movie():
    """Frames of one grey level each, 10 per frame, a white pixel in the corner: blocks of 4, 4, 1."""
    frames = np.full((FRAMES, HEIGHT, WIDTH), 10, np.uint8) * np.arange(FRAMES, dtype=np.uint8)[:, None, None]
    frames[:, 0, 0] = 255
    return [frames[:4], frames[4:8], frames[8:]]


@pytest.fixture
def profile():
    """Two whiskers at rows 20 and 40; the second is lost in frames 3 to 5, the first node of both never measured."""
    x = np.broadcast_to(np.arange(10.0, 80, 5), (2, FRAMES, 14)) * PIXEL
    y = np.broadcast_to(np.array([20.0, 40.0])[:, None, None], x.shape) * PIXEL
    sd = np.full(x.shape, 1e-6)
    sd[:, :, 0] = np.nan
    sd[1, 3:6] = np.nan
    attrs = {
        "pixel_size": PIXEL,
        "frame_rate": 500.0,
        "names": json.dumps(["C1", "C2"]),
        "lost": json.dumps([[], [[3, 5, "too faint or hidden"]]]),
    }
    own = {"whisker": np.arange(2), "time": np.arange(FRAMES) / 500, "node": np.arange(14)}
    return dataset(attrs, lead=("whisker",), **own, x=x, y=y, y_sd=sd, arc_length=x[:, 0])


def coloured(picture, whisker, height=HEIGHT):
    """Columns and rows of the movie's pixels in a whisker's colour [px]."""
    size = picture.shape[1] // WIDTH
    rows, columns = np.nonzero((picture[: height * size] == rgb(whisker)).all(axis=2))
    return (columns + 0.5) / size - 0.5, (rows + 0.5) / size - 0.5


def test_measured_nodes_lie_where_they_were_tracked(movie, profile):
    (picture,) = preview.overlay(movie, profile, [4])
    columns, rows = coloured(picture, 0)
    np.testing.assert_allclose(rows, 20, atol=0.5)
    assert set(np.rint(columns).astype(int)) == set(range(15, 80, 5))
    assert coloured(picture, 1)[0].size == 0  # lost


def test_where_colours_repeat_names_are_at_the_tips(movie, profile):
    """A whisker seven times and, without names, six times: they differ about the tip only."""
    pictures = []
    for count in (preview.FEW, preview.FEW + 1):
        names = json.dumps([f"whisker {k}" for k in range(count)])
        many = profile.isel(whisker=[0] * count).drop_attrs()
        pictures += preview.overlay(movie, many.assign_attrs(profile.attrs | {"names": names, "lost": "[]"}), [4])
    size = pictures[0].shape[1] // WIDTH
    few, named = (one[: HEIGHT * size] for one in pictures)
    ink = (rgb(preview.FEW - 1), rgb(0))  # of the last whisker that is drawn in each
    rows, columns = np.nonzero((few != named).any(axis=2) & ~((few == ink[0]) & (named == ink[1])).all(axis=2))
    assert rows.size > 50
    assert np.abs(rows - 20 * size).max() < 15
    assert np.abs(columns - 75 * size).max() < 15


def test_tracks_without_reasons_of_lost_frames_are_drawn(movie, profile):
    with_reasons = next(preview.overlay(movie, profile, [1]))
    del profile.attrs["lost"]
    np.testing.assert_array_equal(next(preview.overlay(movie, profile, [1])), with_reasons)


def test_frames_are_those_asked_for(movie, profile):
    pictures = list(preview.overlay(movie, profile, [0, 3, 4, 8]))
    assert [int(one[30, 200, 0]) for one in pictures] == [0, 30, 40, 80]
    assert len({one.shape for one in pictures}) == 1


def test_text_tells_frame_and_loss(movie, profile):
    text = {index: picture[HEIGHT * (picture.shape[1] // WIDTH) :] for index, picture in _overlaid(movie, profile)}
    third = TEXT + 6
    frame = {index: strip[:third].tobytes() for index, strip in text.items()}
    second = {index: strip[2 * third :].tobytes() for index, strip in text.items()}
    assert len(set(frame.values())) == FRAMES
    assert {index for index, strip in second.items() if strip != second[0]} == {3, 4, 5}
    assert all(strip.any() for strip in text.values())


def _overlaid(movie, profile):
    return enumerate(preview.overlay(movie, profile, range(FRAMES)))


def test_a_movie_shorter_than_its_tracks_is_refused(movie, profile):
    with refusal("missing", "movie", value="4 frames"):
        list(preview.overlay(movie[:1], profile, [1, 8]))


@pytest.mark.parametrize(("most", "frames"), [(1, [3]), (2, [3, 12]), (4, [3, 6, 9, 12]), (99, list(range(3, 13)))])
def test_frames_are_chosen_evenly(most, frames):
    assert preview.evenly(3, 12, most) == frames


@pytest.mark.parametrize("bad", [(-1, 5, 3), (5, 4, 3), (0, 5, 0)])
def test_no_frames_are_refused(bad):
    with refusal("range"):
        preview.evenly(*bad)


@pytest.mark.parametrize("suffix", [".mp4", ".mkv"])
def test_the_movie_is_one_that_players_show(movie, profile, tmp_path, suffix):
    path = tmp_path / f"preview{suffix}"
    assert preview.write_preview(path, movie, profile, [0, 2, 4, 8]) == 4
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        pictures = [frame.to_ndarray(format="rgb24") for frame in file.decode(stream)]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
    assert len(pictures) == 4
    sent = list(preview.overlay(movie, profile, [0, 2, 4, 8]))
    for one, other in zip(pictures, sent, strict=True):
        assert np.abs(one.astype(float) - other[: one.shape[0], : one.shape[1]]).mean() < 6  # lossy, chroma halved
    assert list(tmp_path.iterdir()) == [path]


def test_equal_previews_are_equal_files(movie, profile, tmp_path):
    for name in ("a.mp4", "b.mp4"):
        preview.write_preview(tmp_path / name, movie, profile)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()


@pytest.mark.parametrize(
    ("name", "frames", "rule"),
    [
        ("a.avi", [np.zeros((4, 4, 3), np.uint8)], ("format", "a.avi")),
        ("a.mp4", [], ("range", "frames")),
        ("a.mp4", [np.zeros((4, 4), np.uint8)], ("shape", "frames")),
        ("a.mp4", [np.zeros((16, 16, 3), np.uint8), np.zeros((16, 18, 3), np.uint8)], ("shape", "frames")),
    ],
)
def test_a_bad_movie_leaves_no_file(tmp_path, name, frames, rule):
    with refusal(*rule):
        write_colour(tmp_path / name, frames)
    assert not list(tmp_path.iterdir())


def test_the_sheet_holds_frames_and_measured_lines(movie, profile):
    data = preview.compute(movie, profile, [0, 4])
    assert data.image.dims == ("time", "image_row", "image_column")
    np.testing.assert_array_equal(data.image[:, 30, 30], [0, 40])
    np.testing.assert_allclose(data.time, [0, 4 / 500])
    np.testing.assert_allclose(data.line_row[0, 0, 1:], 20)
    np.testing.assert_allclose(data.line_column[0, 0, 1:], np.arange(15, 80, 5))
    assert np.isnan(data.line_row[:, :, 0]).all()
    assert np.isnan(data.line_row[1, 1]).all()
    assert np.isfinite(data.line_row[0, 1, 1:]).all()


def test_the_sheet_has_a_panel_for_each_frame_and_says_what_is_not_seen(movie, profile):
    figure = preview.draw(preview.compute(movie, profile, [0, 4, 5, 8]))
    titles = [axes.get_title(loc="left") for axes in figure.axes if axes.get_title(loc="left")]
    assert titles == ["frame 0, 0.0000 s", "frame 4, 0.0080 s", "frame 5, 0.0100 s", "frame 8, 0.0160 s"]
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert texts.count("C2 not seen") == 2
    assert "2 mm" in texts  # of a field of 9.1 mm


def test_the_sheet_counts_columns_and_rows_in_pixels(movie, profile):
    data = preview.compute(movie, profile, [0, 4, 5, 8])
    figure = preview.draw(data)
    panels = [axes for axes in figure.axes if axes.get_title(loc="left")]
    for panel in panels:
        assert (panel.get_xlim(), panel.get_ylim()) == (
            (-0.5, data.sizes["image_column"] - 0.5),
            (data.sizes["image_row"] - 0.5, -0.5),
        )
    figure.draw_without_rendering()
    assert [any(text.get_text() and text.get_visible() for text in one.get_xticklabels()) for one in panels] == [
        False,
        True,
        True,
        True,
    ]
    assert (panels[0].get_ylabel(), panels[3].get_xlabel()) == ("row [px]", "column [px]")


def test_a_part_that_leaves_out_frames_is_shown_on_its_own_pictures(movie, profile):
    """Each picture's grey is ten times its number: every second from 2 on, in any order, or every third."""
    part = profile.isel(time=slice(2, None, 2))
    rest = [movie[0][2:], *movie[1:]]
    data = preview.compute(rest, part, [3, 0, 2])
    assert json.loads(data.attrs["frames"]) == [8, 2, 6]
    assert data.image.values[:, 30, 30].tolist() == [80, 20, 60]
    every_third = profile.isel(time=slice(0, None, 3))
    assert [int(one[30, 200, 0]) for one in preview.overlay(movie, every_third, [0, 2])] == [0, 60]


def test_a_line_at_the_edge_of_the_picture_does_not_push_the_title_out_of_the_figure(movie, profile):
    high = profile.assign(y=profile.y - 19 * PIXEL)  # the box that is magnified reaches above the first row
    figure = preview.draw(preview.compute(movie, high, [0, 4]))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    for panel in figure.axes[:2]:
        assert panel.get_ylim() == (HEIGHT - 0.5, -0.5)
        top = max(
            text.get_window_extent(canvas.get_renderer()).y1
            for text in panel.findobj(Text)
            if text.get_text()[:5] == "frame"
        )
        assert top <= figure.bbox.height
