"""Whether a movie is followed or linked: by what is given, else by whether its whiskers keep their place."""

import numpy as np
import pytest
from drawn_lines import DrawnLine, draw
from refusals import refusal

from vibrissa.video.linked.held_whiskers import look
from vibrissa.video.linked.tracking_way import choose_way


def movie(swing, frames=48, seed=1):
    """Two lines that turn about their left ends by ± ``swing`` degrees."""
    rng, out = np.random.default_rng(seed), []
    for k in range(frames):
        turn = np.radians(swing) * np.sin(2 * np.pi * k / 20)
        lines = []
        for base, rest in ((40.0, -0.15), (80.0, 0.2)):
            angle = rest + turn
            lines.append(line_from((12.0, base), angle))
        out.append(draw(lines, rng=rng))
    return np.stack(out)


def line_from(base, angle, length=90.0, middle=63.5):
    """A line that leaves its base, as the drawing takes it."""
    centre = np.array(base) + length / 2 * np.array([np.cos(angle), np.sin(angle)]) - middle
    return DrawnLine(angle, float(centre[1] * np.cos(angle) - centre[0] * np.sin(angle)), length / 2)


def unread():
    raise AssertionError("no look is needed")


@pytest.mark.parametrize(("swing", "method"), [(0.0, "follow"), (1.0, "follow"), (12.0, "link"), (25.0, "link")])
def test_whiskers_that_keep_their_place_are_followed_and_others_linked(swing, method):
    frames = movie(swing)
    way = choose_way(lambda: [frames], "auto")
    assert way.method == method
    assert ("keep their place" if method == "follow" else "move away") in way.reason
    assert len(way.seeds) == (2 if method == "follow" else 0)


def test_what_is_given_decides():
    assert choose_way(unread, "auto", following=["seeds"]).method == "follow"
    assert choose_way(unread, "auto", linking=["marks"]).method == "link"
    assert choose_way(unread, "link").method == "link"
    frames = movie(25.0)
    assert choose_way(lambda: [frames], "follow").method == "follow"
    assert choose_way(lambda: [frames], "auto", following=["skin"]).method == "follow"


@pytest.mark.parametrize(
    ("asked", "following", "linking", "rule"),
    [
        ("link", ["seeds"], [], ("conflict", "seeds")),
        ("follow", [], ["marks"], ("conflict", "marks")),
        ("auto", ["skin"], ["marks"], ("conflict", "marks")),
    ],
)
def test_what_excludes_each_other_is_refused(asked, following, linking, rule):
    with refusal(*rule):
        choose_way(unread, asked, following=following, linking=linking)


def test_a_bad_first_frame_is_passed_over():
    good = movie(0.5)
    rng = np.random.default_rng(4)
    torn = rng.integers(0, 255, good.shape[1:]).astype(np.uint8)
    bad = np.concatenate([np.zeros_like(good[:1]), torn[None], good])
    way = choose_way(lambda: [bad], "auto", start=10)
    assert (way.method, way.first, len(way.seeds)) == ("follow", 12, 2)
    assert look(lambda: [good]).first == 0


def test_a_movie_that_shows_no_whisker_cannot_be_followed():
    noise = np.random.default_rng(0).normal(150, 2, (8, 64, 64)).astype(np.uint8)
    with refusal("too-few", "whiskers"):
        choose_way(lambda: [noise], "follow")
    assert choose_way(lambda: [noise], "auto").method == "link"
