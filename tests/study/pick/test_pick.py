"""Picking: what is picked in the first frame is written as a study that runs, and bad picks are told in one line."""

import http.client
import json
import socket
import threading
import time
import tomllib
import urllib.error
import urllib.request
from contextlib import contextmanager
from io import BytesIO

import numpy as np
import pytest
from matplotlib.image import imread
from refusals import refusal

from vibrissa.netcdf import load
from vibrissa.study.pick import local_page
from vibrissa.study.pick.pick import as_toml, pick, pixel_size, write_study
from vibrissa.study.pick.pick_page import png, render_page
from vibrissa.study.run.study import run_study
from vibrissa.study.spec.settings import read_study
from vibrissa.video.camera.rendering import Camera, exposure_times, render
from vibrissa.video.io.movie import write_movie

PIXEL, RATE, FRAMES = 1e-4, 500.0, 12
ROWS = (50.0, 90.0)  # of the two whiskers at their bases [px]


def truth(column):
    """Rows of both whiskers in the first frame [px]."""
    return np.array([row + 0.1 * (column - 30) for row in ROWS])


@pytest.fixture(scope="module")
def movie(tmp_path_factory):
    camera = Camera(frame_rate=RATE, pixel_size=PIXEL, width=200, height=150, exposure=1e-3)
    wave = 0.5 * np.sin(2 * np.pi * 40 * exposure_times(camera, FRAMES))
    columns = np.arange(30.0, 190.0)
    y = truth(columns)[:, None] + wave[None, :, None]
    x = np.broadcast_to(columns, y.shape)
    path = tmp_path_factory.mktemp("movie") / "touch.mkv"
    write_movie(path, render(x * PIXEL, y * PIXEL, camera, seed=1))
    return path


@pytest.fixture
def image():
    """Two dark lines, drawn here."""
    column, row = np.meshgrid(np.arange(200), np.arange(150))
    dark = sum(90 * np.exp(-((row - at) ** 2) / 2) * (column >= 30) for at in truth(column))
    noise = 2 * np.random.default_rng(0).standard_normal(dark.shape)
    return np.rint(180 - dark + noise).astype(np.uint8)


GOOD = {"frame_rate": RATE, "pixel_size": PIXEL, "seeds": [[60, 53], [60, 93]], "base": "left", "polarity": "dark"}


def test_found_whiskers_make_a_study_that_runs(movie, tmp_path):
    study, told = tmp_path / "touch.toml", []
    assert pick(movie, study, frame_rate=RATE, pixel_size=PIXEL, page=False, tell=told.append)
    assert told == ["2 whiskers found, the bases on the left"]
    run_study(read_study(study), tmp_path / "out")
    profile = load(tmp_path / "out" / "profile.nc")
    assert profile.sizes["whisker"] == 2
    x, y = (profile[name].isel(time=0).values / PIXEL for name in ("x", "y"))
    expected = np.array(ROWS)[:, None] + 0.1 * (x - 30)
    np.testing.assert_allclose(np.nanmedian(y - expected, axis=1), 0, atol=0.05)


def test_everything_given_stands_in_the_file(movie, tmp_path):
    study = tmp_path / "touch.toml"
    pick(
        movie,
        study,
        frame_rate=RATE,
        pixel_size=PIXEL,
        seeds=[(60, 53), (60, 93)],
        names=["C1", "C2"],
        skin=[(30, 50), (30, 90)],
        substrate=[(190, 10), (190, 140)],
        base="left",
        page=False,
    )
    read = read_study(study).movie
    assert (study.parent / read.path).resolve() == movie.resolve()
    assert read.seeds == ((60, 53), (60, 93))
    assert read.skin == ((30, 50), (30, 90))
    assert read.substrate == ((190, 10), (190, 140))
    assert read.names == ("C1", "C2")
    assert (read.frame_rate, read.pixel_size, read.base) == (RATE, PIXEL, "left")


def test_scale_is_length_over_distance():
    assert pixel_size([(10, 20), (40, 60)], 5e-3) == pytest.approx(1e-4)


@pytest.mark.parametrize("scale", [[], [(1, 1)], [(1, 1), (1, 1)]])
def test_a_scale_of_no_length_is_refused(scale):
    with refusal("shape", "scale"):
        pixel_size(scale, 1e-3)


@pytest.mark.parametrize(
    ("bad", "told"),
    [
        ({"frame_rate": None}, ("missing", "frame_rate")),
        ({"frame_rate": -5}, ("missing", "frame_rate")),
        ({"frame_rate": "fast"}, ("missing", "frame_rate")),
        ({"pixel_size": None}, ("shape", "scale")),
        ({"pixel_size": None, "scale": [[0, 0], [9, 0]]}, ("missing", "scale_length")),
        ({"pixel_size": 0.1}, ("range", "Calibration.pixel_size")),
        ({"seeds": []}, ("range", "seeds")),
        ({"seeds": [[60, 53], [60, 20]]}, ("range", "seed")),
        ({"seeds": [[600, 53]]}, ("range", "seeds")),
        ({"seeds": [[60]]}, ("format", "study: movie.seeds.0.1")),
        ({"seeds": "everywhere"}, ("format", "study: movie.seeds")),
        ({"skin": [[30, 50]]}, ("shape", "skin")),
        ({"substrate": [[190, 10]]}, ("format", "study: movie.substrate.1")),
        ({"substrate": [[190, 10], [190, 10]]}, ("shape", "substrate")),
        ({"names": ["C1"]}, ("shape", "names")),
        ({"base": "front"}, ("format", "study: movie.base")),
        ({"colour": "red"}, ("unknown", "colour")),
    ],
)
def test_a_bad_pick_is_told_in_one_line_and_nothing_is_written(image, tmp_path, bad, told):
    study = tmp_path / "study.toml"
    with refusal(*told) as error:
        write_study(GOOD | bad, image, tmp_path / "movie.mkv", study)
    assert "\n" not in str(error.value)
    assert not list(tmp_path.iterdir())


def test_a_study_is_replaced_only_by_force(image, tmp_path):
    study = tmp_path / "study.toml"
    study.write_text("mine")
    with refusal("conflict", "study.toml"):
        write_study(GOOD, image, tmp_path / "movie.mkv", study)
    assert study.read_text() == "mine"
    write_study(GOOD, image, tmp_path / "movie.mkv", study, force=True)
    assert read_study(study).movie.frame_rate == RATE


def test_an_empty_image_has_nothing_to_write(tmp_path):
    blank = tmp_path / "blank.tif"
    write_movie(blank, [np.full((1, 60, 80), 200, np.uint8)])
    with refusal("too-few", "whiskers"):
        pick(blank, tmp_path / "s.toml", frame_rate=RATE, pixel_size=PIXEL, page=False)


def test_text_is_what_toml_reads_back():
    table = {
        "name": 'a "movie" \\ ünder\tway',
        "movie": {"path": "x/y.avi", "seeds": [[1, 2.5]], "pixel_size": 9.5e-05},
    }
    assert tomllib.loads(as_toml(table)) == table


# The page


@contextmanager
def served(movie, study, **given):
    """Serve the page in a thread; give its address and the result's list."""
    told, result, ready = [], [], threading.Event()

    def tell(line):
        told.append(line)
        if "http" in line:
            ready.set()

    thread = threading.Thread(
        target=lambda: result.append(pick(movie, study, browser=False, tell=tell, **given)), daemon=True
    )
    thread.start()
    assert ready.wait(30)
    address = next(word for word in told[-1].split() if word.startswith("http"))
    yield address, result
    thread.join(30)
    assert not thread.is_alive()


def post(address, place, content, origin=None):
    body = content if isinstance(content, bytes) else json.dumps(content).encode()
    request = urllib.request.Request(address + place, body, {"Origin": origin or "/".join(address.split("/")[:3])})
    try:
        with urllib.request.urlopen(request, timeout=30) as answer:
            return answer.status, json.loads(answer.read())
    except urllib.error.HTTPError as error:
        with error:
            return error.code, json.loads(error.read())


def test_the_page_saves_what_is_picked_and_ends(movie, tmp_path):
    study = tmp_path / "s.toml"
    with served(movie, study) as (address, result):
        code, answer = post(address, "save", GOOD | {"frame_rate": 0})
        assert code == 422
        assert answer["error"].startswith("frame_rate must be given")
        assert post(address, "save", b"{")[0] == 400
        assert post(address, "save", [1])[0] == 400
        assert not study.exists()
        scale = {"pixel_size": None, "scale": [[10, 20], [40, 60]], "scale_length": 5e-3}
        assert post(address, "save", GOOD | scale) == (200, {"saved": True})
    assert result == [True]
    assert read_study(study).movie.pixel_size == pytest.approx(PIXEL)


HOSTILE = [
    b"[" * 200_000,
    b'{"seeds":' * 100_000,
    b'{"frame_rate": ' + b"9" * 5000 + b"}",
    b"\xff\xfe",
    b'{"names": ["\\ud800"]}',
    {**GOOD, "frame_rate": 10**400},
    {**GOOD, "frame_rate": {}},
    {**GOOD, "pixel_size": None, "scale": True, "scale_length": 1},
    {**GOOD, "pixel_size": None, "scale": [1, 2], "scale_length": 1},
    {**GOOD, "pixel_size": None, "scale": {"0": [1, 1], "1": [2, 2]}, "scale_length": 1},
    {**GOOD, "pixel_size": None, "scale": [[10**400, 0], [0, 0]], "scale_length": 1},
    {**GOOD, "pixel_size": None, "scale": [[1e308, -1e308], [-1e308, 1e308]], "scale_length": 1},
    {**GOOD, "seeds": {"a": 1}},
    {**GOOD, "seeds": [[1e999, 5]]},
    {**GOOD, "seeds": [[True, None]]},
    {**GOOD, "skin": 7},
    {**GOOD, "names": [[]]},
    {**GOOD, "base": ["left"]},
    {"": 1},
]


def test_odd_json_is_one_line_and_the_page_goes_on(movie, tmp_path, capfd):
    with served(movie, tmp_path / "s.toml") as (address, _):
        for content in HOSTILE:
            code, answer = post(address, "save", content)
            assert code in (400, 422), (content, answer)
            assert answer["error"]
            assert "\n" not in answer["error"]
        assert post(address, "quit", {}) == (200, {"saved": False})
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr() == ("", "")


def test_a_page_of_another_origin_saves_nothing(movie, tmp_path):
    study = tmp_path / "s.toml"
    with served(movie, study) as (address, _):
        host = address.split("/")[2]
        for origin in ("http://evil.example", "null", f"https://{host}", "http://127.0.0.1:1", f"http://{host}.evil"):
            line = http.client.HTTPConnection(host, timeout=30)
            line.request("POST", address.partition(host)[2] + "save", json.dumps(GOOD), {"Origin": origin})
            assert line.getresponse().status == 404
            line.close()
        line = http.client.HTTPConnection(host, timeout=30)
        line.request("POST", address.partition(host)[2] + "save", json.dumps(GOOD))
        assert line.getresponse().status == 403
        line.close()
        assert not study.exists()
        post(address, "quit", {})


@pytest.mark.parametrize(
    ("headers", "body", "code"),
    [
        ("Content-Length: 5\r\nTransfer-Encoding: chunked", b"9\r\n{}       \r\n0\r\n\r\n", 400),
        ("Transfer-Encoding: chunked", b"2\r\n{}\r\n0\r\n\r\n", 400),
        ("Content-Length: 1048577", b"{}", 400),
        ("Content-Length: " + "9" * 5000, b"{}", 400),
        ("Content-Length: -1", b"{}", 400),
        ("Content-Length: 9", b"{}", 408),
    ],
    ids=["both", "chunked", "long", "endless", "negative", "slow"],
)
def test_a_body_is_limited_whatever_its_headers_say(movie, tmp_path, monkeypatch, headers, body, code):
    monkeypatch.setattr(local_page, "PATIENCE", 1.0)
    with served(movie, tmp_path / "s.toml") as (address, _):
        host, place = address.split("/")[2], address.split("/", 3)[3]
        with socket.create_connection(tuple(host.split(":")), timeout=30) as line:
            head = f"POST /{place}save HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n{headers}\r\n\r\n"
            line.sendall(head.encode() + body)
            for _ in range(3 if code == 408 else 0):
                time.sleep(0.4)
                line.sendall(b" ")
            assert line.recv(100).split()[1] == str(code).encode()
        post(address, "quit", {})


def test_giving_up_writes_nothing(movie, tmp_path):
    with served(movie, tmp_path / "s.toml") as (address, result):
        assert post(address, "quit", {}) == (200, {"saved": False})
    assert result == [False]
    assert not list(tmp_path.iterdir())


def test_only_who_knows_the_address_gets_in(movie, tmp_path):
    with served(movie, tmp_path / "s.toml") as (address, _):
        host = address.split("/")[2]
        assert host.startswith("127.0.0.1:")
        strangers = [
            ("/", host),
            ("/guess/", host),
            ("/guess/frame.png", host),
            ("/" + address.split("/")[3] + "/", "evil.org:80"),
        ]
        for path, name in strangers:
            line = http.client.HTTPConnection(host, timeout=30)
            line.request("GET", path, headers={"Host": name})
            assert line.getresponse().status == 404
            line.close()
        with urllib.request.urlopen(address, timeout=30) as answer:
            policy = answer.headers["Content-Security-Policy"]
            page = answer.read().decode()
        assert "default-src 'none'" in policy
        assert "'unsafe" not in policy
        assert "touch.mkv" in page
        with urllib.request.urlopen(address + "frame.png", timeout=30) as answer:
            assert answer.read().startswith(b"\x89PNG")
        post(address, "quit", {})


def test_the_page_loads_nothing_from_elsewhere_and_hides_nothing_in_names():
    page = render_page({"movie": "<script>alert(1)</script>", "study": "s", "width": 9, "height": 9}, "n0")
    assert "<script>alert" not in page
    assert "://" not in page
    assert "<noscript>" in page
    for name in ("frame_rate", "scale_length", "pixel_size", "base", "polarity", "names"):
        assert f'for="{name}"' in page
        assert f'id="{name}"' in page


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_picture_holds_the_grey_levels(kind):
    image = (np.arange(35).reshape(5, 7) * (7 if kind == np.uint8 else 1000)).astype(kind)
    data = png(image)
    levels = np.rint(255 * imread(BytesIO(data))).astype(np.uint8)[..., :3]
    expected = image if kind == np.uint8 else np.rint(image * (255 / 34000))
    np.testing.assert_array_equal(levels, np.repeat(expected[..., None], 3, axis=2))
