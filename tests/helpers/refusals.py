"""Refusals of bad input, checked by the fields of the error."""

import re
from contextlib import contextmanager

import pytest

from vibrissa.errors import InputError


def bare(quantity):
    """Leave the folders out of the names of files."""
    return re.sub(r"[^\s\"'(]*/", "", quantity)


@contextmanager
def refusal(code, quantity=None, value=None):
    """Expect bad input of one kind, in a quantity or a file that is named, with the value that was found."""
    with pytest.raises(InputError) as caught:
        yield caught
    error = caught.value
    assert "\n" not in str(error)
    assert error.code == code, error
    assert quantity is None or bare(error.quantity) == bare(quantity), error
    assert value is None or error.value == value, error
