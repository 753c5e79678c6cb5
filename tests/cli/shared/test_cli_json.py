"""What --json prints of numbers that JSON has no sign for."""

import json

import numpy as np

from vibrissa.cli.shared.display.output import print_json


def test_what_was_not_measured_is_null_and_what_has_no_limit_is_infinity(capsys):
    print_json({"d": np.array([1.5, np.nan, np.inf, -np.inf]), "n": [{"one": np.float64(np.inf)}]})
    found = json.loads(capsys.readouterr().out)
    assert found == {"d": [1.5, None, "Infinity", "-Infinity"], "n": [{"one": "Infinity"}]}
