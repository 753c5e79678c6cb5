"""Files that a study reads: all that its keys name, and nothing that is no file."""

import dataclasses
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

from vibrissa.mechanics.statics.profile import Posture
from vibrissa.study.spec.base_signal import BaseSignal
from vibrissa.study.spec.described import described
from vibrissa.study.spec.inputs import input_files
from vibrissa.study.spec.neurons import Neurons
from vibrissa.study.spec.settings import MovieFile, Study
from vibrissa.study.spec.textures import TextureFile
from vibrissa.whisker import Whisker

STUDY = "relative to the study file"
TABLE = "track,animal,whisker,texture,scan_speed\nday.nc,r,C2,plate.csv,0.1\n"


def classes_of(hint):
    """Dataclasses within a type, such as those of ``tuple[BaseSignal, ...]``, and of their own fields."""
    if dataclasses.is_dataclass(hint):
        return {hint}.union(*map(classes_of, get_type_hints(hint).values()))
    return set().union(*map(classes_of, get_args(hint)))


def test_every_key_that_is_documented_as_a_path_is_an_input(tmp_path):
    named = {
        kind: {key: f"{kind.__name__}.{key}" for key, text in described(kind).items() if STUDY in text}
        for kind in classes_of(Study)
    }
    (tmp_path / named[Study]["sweeps"]).write_text(TABLE)
    touched = {"whisker": Whisker(length=0.04, cone_angle=1.5e-3), "posture": Posture(contact=0.3, base_angle=1.2)}
    study = Study(
        name="all",
        folder=tmp_path,
        movie=MovieFile(pixel_size=1e-4, **named[MovieFile]),
        texture=TextureFile(**named[TextureFile]),
        base_signal=(BaseSignal(kind="moment", unit="V", scan_speed=0.1, **touched, **named[BaseSignal]),),
        neural=(Neurons(**named[Neurons]),),
        **named[Study],
    )
    paths = {path for of_kind in named.values() for path in of_kind.values()}
    assert set(input_files(study)) == paths | {"day.nc", "plate.csv"}
    assert {"MovieFile.background", "MovieFile.head", "Neurons.kept", "Neurons.trial_table"} < paths


@pytest.mark.parametrize("background", ["space", "mean", "median"])
def test_words_that_may_be_given_for_a_file_are_no_inputs(background):
    movie = MovieFile(path="m.avi", pixel_size=1e-4, background=background, head="find")
    assert set(input_files(Study(name="one", movie=movie))) == {"m.avi"}


def test_a_table_of_trials_is_an_input_unless_it_is_in_the_nwb_file(tmp_path):
    def read(spikes):
        one = Neurons(spikes=spikes, stimulus="stimulus.nc", trial_table="blocks")
        return set(input_files(Study(name="one", folder=tmp_path, neural=(one,)))) - {"stimulus.nc"}

    assert read("spikes.csv") == {"spikes.csv", "blocks"}
    assert read("session.nwb") == {"session.nwb"}
    (tmp_path / "blocks").touch()
    assert read("session.nwb") == {"session.nwb", "blocks"}


@pytest.mark.parametrize(
    ("stimulus", "beside", "there"),
    [("s.wav", True, False), ("s.npy", True, False), ("s.csv", True, True), ("s.csv", False, False)],
)
def test_a_command_is_read_with_its_sidecar(tmp_path, stimulus, beside, there):
    sidecar = f"{stimulus}.json"
    if there:
        (tmp_path / sidecar).touch()
    study = Study(name="one", folder=tmp_path, neural=(Neurons(spikes="spikes.csv", stimulus=stimulus),))
    assert input_files(study).get(sidecar) == (Path(tmp_path, sidecar) if beside else None)
