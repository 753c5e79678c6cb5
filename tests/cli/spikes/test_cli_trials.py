"""Tables of trials and protocols of several stimuli: one for all, or once for each."""

import json
from pathlib import Path

import pytest
from refusals import refusal

from vibrissa.cli.shared.recorded import TrialOptions

SLOW, FAST = ("protocol", "slow"), ("protocol", "fast")


def test_each_stimulus_has_its_own_protocol_and_table():
    given = TrialOptions(only=[SLOW, FAST], trial_table=[Path("trials.csv")], unsorted=True)
    slow, fast = given.each(2)
    assert slow.words()["only"] == SLOW
    assert fast.words()["only"] == FAST
    assert {one.words()["trial_table"] for one in (slow, fast)} == {"trials.csv"}
    assert fast.words()["unsorted"]
    assert [one.words()["only"] for one in TrialOptions().each(2)] == [None, None]


@pytest.mark.parametrize("count", [1, 3])
def test_protocols_that_are_not_one_for_each_are_refused(count):
    with refusal("shape", "--only", "2 times"):
        TrialOptions(only=[SLOW, FAST]).each(count)


def test_the_command_line_takes_an_option_once_for_each_stimulus(vibrissa):
    pair = ("--spikes", "absent.csv", "--stimulus", "absent.csv")
    protocols = [word for name in "abc" for word in ("--only", "protocol", name)]
    code, out, err = vibrissa("drives", *pair, *pair, "--trials", 2, *protocols)
    assert (code, out) == (2, "")
    assert "--only must be given once, or once for each of 2 stimuli, got 3 times" in err
    code, _, err = vibrissa("neural", *pair, *protocols)
    assert code == 2
    assert "--only must be given once, got 3 times" in err


def test_a_protocol_may_be_called_by_a_negative_quantity(vibrissa, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spikes.csv").write_text("unit,spike_time\na,1.5\na,5.5\n")
    (tmp_path / "trials.csv").write_text("start,stop,depth\n1,2,-5mm\n3,4,-6mm\n5,6,-5mm\n")
    words = ("information", "--spikes", "spikes.csv", "--trial-table", "trials.csv", "--window", 0, 1)
    code, out, _ = vibrissa(*words, "--only", "depth", "-5mm", "--json")
    assert (code, json.loads(out)["unit_rate"]) == (0, [1.0])
    code, _, err = vibrissa(*words, "--only", "depth", "-7mm")
    assert code == 2
    assert "must be '-7mm' in a row; it is -5mm, -6mm" in err
