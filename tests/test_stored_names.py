"""Names that a profile keeps go with the numbers of its whiskers."""

import json

import numpy as np
import pytest

from vibrissa.figures.canvas import whisker_names
from vibrissa.quantities import dataset
from vibrissa.quantities.tracks import stored_names


def named(*names, numbers=None):
    """A profile of whiskers with these names."""
    profile = dataset({"names": json.dumps(names)}, lead=("whisker",), x=np.zeros((len(names), 2, 3)))
    return profile.assign_coords(whisker=numbers or list(range(len(names))))


def test_some_whiskers_of_a_profile_keep_their_names():
    profile = named("A", "B", "C", "D")
    assert stored_names(profile.isel(whisker=[3, 1])) == whisker_names(profile.isel(whisker=[3, 1])) == ["D", "B"]


@pytest.mark.parametrize("numbers", [[1, 2, 3], [10, 11, 12], ["a", "b", "c"]])
def test_whiskers_that_are_numbered_otherwise_have_names_in_order(numbers):
    assert stored_names(named("A", "B", "C", numbers=numbers)) == ["A", "B", "C"]


def test_without_names_whiskers_are_numbers():
    profile = named("A", "B").drop_attrs()
    assert stored_names(profile) == []
    assert whisker_names(profile.isel(whisker=[1])) == ["whisker 1"]
