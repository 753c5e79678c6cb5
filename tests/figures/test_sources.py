"""Captions name the source of their panels, and one whisker has one name and one mark in all figures."""

import xarray as xr

from vibrissa.figures.sources import of_movie, of_sweeps, printed_name, whisker_marks


def test_a_movie_is_simulated_where_its_apparatus_is_known():
    assert of_movie({"apparatus": xr.Dataset()}) == "one sweep of the one-contact model"
    assert of_movie({"profile": xr.Dataset()}) == "one recorded movie"


def test_sweeps_are_rods_or_the_model_or_recorded():
    assert of_sweeps(xr.Dataset(attrs={"laboratory": '{"truth": "rod"}'})) == "sweeps of simulated rods"
    assert of_sweeps(xr.Dataset(attrs={"laboratory": '{"truth": "modes"}'})) == "sweeps of the one-contact model"
    assert of_sweeps(xr.Dataset()) == of_sweeps(None) == "recorded sweeps"


def test_greek_letters_are_printed_as_such():
    assert [printed_name(one) for one in ("beta", "rat 1 gamma", "C2", "alphabet")] == [
        "β",
        "rat 1 γ",
        "C2",
        "alphabet",
    ]


def test_the_whiskers_of_the_paper_keep_their_marks_whatever_others_there_are():
    several = whisker_marks(["D1", "C2", "A1"])
    assert whisker_marks(["beta"])["C2"] == several["C2"]
    assert len({several[one] for one in ("beta", "C1", "C2", "A1", "D1")}) == 5
