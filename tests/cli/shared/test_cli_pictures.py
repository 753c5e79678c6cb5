"""The option --picture: the kinds of files, what a page holds, and what is refused before any work."""

import re

import pytest

CONE = ("--whisker.length", "40mm", "--whisker.cone-angle", "1.5mrad")
POSTURE = ("--contact", "0.29", "--base-angle", "70deg")


@pytest.mark.parametrize(
    "words",
    [
        ("modes", "--contact", "0.3", *CONE),
        ("profile", *POSTURE, *CONE),
        ("gap", *POSTURE, "--gap-width", "0.015", *CONE),
    ],
)
def test_a_picture_as_html_has_one_figure_and_nothing_from_elsewhere(vibrissa, tmp_path, words):
    code, out, _ = vibrissa(*words, "--picture", tmp_path / "one.html")
    assert code == 0
    assert out
    page = (tmp_path / "one.html").read_text()
    assert page.count("<svg") == 1
    assert "<script" not in page
    assert not re.search(r'(src|href)="(?!#|data:)', page)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("profile", *POSTURE, "--picture", "a.gif"), "--picture must end in .png, .pdf, .svg, .html, got"),
        (("profile", *POSTURE, "--picture", "pages"), "--picture must end in"),
        (("neural", "--spikes", "s.csv", "--stimulus", "t.csv", "--picture", "a.gif"), ".html, or be a folder"),
        (("neural", "--spikes", "s.csv", "--stimulus", "t.csv", "--picture", "no/pages"), "in an existing folder"),
        (("neural", "--spikes", "s.csv", "--stimulus", "t.csv", "--unit-page", "u1"), "--unit-page must go with"),
        (
            ("neural", "--spikes", "s.csv", "--stimulus", "t.csv", "--picture", "a.pdf", "--most-pages", "-1"),
            "--most-pages must be zero or positive",
        ),
    ],
)
def test_a_picture_that_cannot_be_written_is_refused_at_once(vibrissa, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    code, out, err = vibrissa(*words)
    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
