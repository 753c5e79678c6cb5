"""Tables of DeepLabCut in HDF5 and text: rows are frames, columns have names."""

import numpy as np
import pandas as pd
import pytest
from refusals import refusal

from vibrissa.video.foreign.head_points import read_head
from vibrissa.video.foreign.tracks import read_tracks
from vibrissa.video.tracking import Calibration

pytest.importorskip("movement")

PIXEL = 1e-4
CALIBRATION = Calibration(frame_rate=500.0, pixel_size=PIXEL)
FRAMES = 12
NAMES = ("base", "middle", "tip")
X = 50 + 20.0 * np.arange(3) + np.arange(FRAMES)[:, None]
Y = 100 + np.arange(3) ** 2 + 0.5 * np.arange(FRAMES)[:, None]


def predictions() -> pd.DataFrame:
    columns = {}
    for number, name in enumerate(NAMES):
        columns["net", name, "x"], columns["net", name, "y"] = X[:, number], Y[:, number]
        columns["net", name, "likelihood"] = np.full(FRAMES, 0.99)
    table = pd.DataFrame(columns)
    return table.set_axis(table.columns.set_names(["scorer", "bodyparts", "coords"]), axis=1)


def written(table: pd.DataFrame, path):
    if path.suffix == ".h5":
        table.to_hdf(path, key="df_with_missing", format="table")
    else:
        table.to_csv(path)
    return path


@pytest.fixture(params=["a.csv", "a.h5", "a.CSV"])
def path(request, tmp_path):
    return tmp_path / request.param


def test_nodes_are_the_keypoints_of_the_table(path):
    profile = read_tracks(written(predictions(), path), CALIBRATION)
    np.testing.assert_allclose([profile.x[0], profile.y[0]], np.array([X, Y]) * PIXEL, rtol=1e-12)


FRAME_NUMBERS = {
    "a gap": (lambda table: table.drop(index=range(4, 7)), "must have frame 4 in row 4", "'7'"),
    "a later start": (lambda table: table.iloc[3:], "must have frame 0 in row 0", "'3'"),
    "backwards": (lambda table: table.iloc[::-1], "must have frame 0 in row 0", "'11'"),
    "halves": (lambda table: table.set_axis(np.arange(FRAMES) / 2), "must have frame 1 in row 1", "'0.5'"),
    "images": (
        lambda table: table.set_axis([f"img{i}.png" for i in range(FRAMES)]),
        "must have frame 0 in row 0",
        "'img0.png'",
    ),
}


@pytest.mark.parametrize("change", FRAME_NUMBERS)
def test_rows_that_are_not_the_frames_from_0_on_are_refused(change, path):
    of, rule, value = FRAME_NUMBERS[change]
    with refusal("format", path.name, value=value) as caught:
        read_tracks(written(of(predictions()), path), CALIBRATION)
    assert caught.value.rule == rule
    assert "a row for every frame" in caught.value.remedy


def test_labels_of_pictures_are_no_predictions(tmp_path):
    labels = predictions().iloc[[5, 7]].drop(columns="likelihood", level="coords")
    labels.index = pd.MultiIndex.from_tuples([("labeled-data", "day 1", f"img{i:04d}.png") for i in (5, 7)])
    labels.to_hdf(tmp_path / "CollectedData_me.h5", key="df_with_missing")
    with refusal("format", "CollectedData_me.h5") as caught:
        read_tracks(tmp_path / "CollectedData_me.h5", CALIBRATION)
    assert caught.value.remedy == "give predictions, a row for every frame"


def test_a_head_from_a_later_frame_on_is_refused(path):
    with refusal("format", path.name, value="'3'"):
        read_head(written(predictions().iloc[3:], path), FRAMES, ("base", "tip"))


def of_individual(table: pd.DataFrame, name: str = "rat") -> pd.DataFrame:
    """The table of a project of several animals, with one of them."""
    columns = [(net, name, *rest) for net, *rest in table.columns]
    levels = ["scorer", "individuals", "bodyparts", "coords"]
    return table.set_axis(pd.MultiIndex.from_tuples(columns, names=levels), axis=1)


def test_a_head_of_a_project_of_several_animals_may_end_before_the_movie(path):
    """DeepLabCut's stitcher writes rows up to the last frame that has an animal."""
    head = read_head(written(of_individual(predictions()), path), FRAMES + 3, ("base", "tip"))
    np.testing.assert_allclose(head.column[:FRAMES], X[:, 2], rtol=1e-12)
    assert head.known.tolist() == [True] * FRAMES + [False] * 3
    with refusal("range", path.name, value=str(FRAMES)):
        read_head(path, FRAMES - 1, ("base", "tip"))
    with refusal("range", path.name, value=str(FRAMES)):
        read_head(written(predictions(), path), FRAMES + 3, ("base", "tip"))


def test_whole_numbers_of_frames_may_have_a_decimal(path):
    profile = read_tracks(written(predictions().set_axis(np.arange(float(FRAMES))), path), CALIBRATION)
    np.testing.assert_allclose(profile.y[0], Y * PIXEL, rtol=1e-12)


ORDERS = {
    "y before x": [3 * part + axis for part in range(3) for axis in (1, 0, 2)],
    "by coordinate": [3 * part + axis for axis in range(3) for part in range(3)],
    "likelihood first": [3 * part + axis for part in range(3) for axis in (2, 0, 1)],
}


@pytest.mark.parametrize("order", ORDERS)
def test_columns_are_found_by_their_names(order, path):
    profile = read_tracks(written(predictions().iloc[:, ORDERS[order]], path), CALIBRATION)
    np.testing.assert_allclose([profile.x[0], profile.y[0]], np.array([X, Y]) * PIXEL, rtol=1e-12)


def test_columns_of_two_scorers_are_refused(path):
    table = predictions()
    both = pd.concat([table, table.rename(columns={"net": "other"}, level="scorer")], axis=1)
    with refusal("format", f"{path.name}, column 'x' of base"):
        read_tracks(written(both, path), CALIBRATION)


def test_an_individual_without_a_keypoint_is_refused(path):
    table = pd.concat({who: predictions()["net"] for who in ("left", "right")}, axis=1)
    table.columns = table.columns.set_names(["individuals", "bodyparts", "coords"])
    table = pd.concat({"net": table}, axis=1, names=["scorer"]).drop(columns=("net", "right", "tip"))
    with refusal("missing", f"{path.name}, column 'x' of tip of right"):
        read_tracks(written(table, path), CALIBRATION)


def test_a_byte_order_mark_is_no_part_of_the_header(tmp_path):
    path = written(predictions(), tmp_path / "a.csv")
    path.write_text(path.read_text(), encoding="utf-8-sig")
    np.testing.assert_allclose(read_tracks(path, CALIBRATION).y[0], Y * PIXEL, rtol=1e-12)


def test_semicolons_between_cells_are_refused_with_the_remedy(tmp_path):
    path = written(predictions(), tmp_path / "a.csv")
    path.write_text(path.read_text().replace(",", ";"))
    with refusal("format", "a.csv") as caught:
        read_tracks(path, CALIBRATION)
    assert "commas between cells" in caught.value.remedy


def test_a_row_with_a_cell_too_few_is_refused(tmp_path):
    path = written(predictions(), tmp_path / "a.csv")
    path.write_text(path.read_text().rstrip().rpartition(",")[0] + "\n")
    with refusal("shape", f"a.csv, line {FRAMES + 3}", value="9"):
        read_tracks(path, CALIBRATION)
