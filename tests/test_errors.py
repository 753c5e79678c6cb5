"""An error is one line, in the process that meets it and in the one that hears of it."""

import pickle

import pytest

from vibrissa.errors import ConvergenceError, InputError


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (InputError("a\nb", "must be\nshort", [1, 2], "cut it"), "a b must be short, got [1, 2]; cut it"),
        (InputError("scan", "must end"), "scan must end"),
        (ConvergenceError("fit", 0.5, 3), "fit did not converge: residual 0.5 after 3 iterations"),
        (ConvergenceError("fit", 1.0, 9, "try less"), "fit did not converge: residual 1 after 9 iterations; try less"),
    ],
)
def test_an_error_is_one_line_that_survives_the_way_between_processes(error, line):
    there = pickle.loads(pickle.dumps(error))
    assert str(error) == str(there) == line
    assert type(there) is type(error)


def test_an_error_keeps_its_thing():
    there = pickle.loads(pickle.dumps(InputError("Posture.contact", "must be given")))
    assert (there.thing, there.said) == ("Posture.contact", "must be given")
