"""Make the figures of the gallery from the built-in experiment.

python docs/make_gallery.py [FOLDER]

By the same calls as ``vibrissa run``, without its report, and ``vibrissa figure``. If the experiment was run in the
folder ``vibrissa-out`` by this very source, as ``python3 run.py`` does, its results are taken.
"""

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from vibrissa.netcdf import save
from vibrissa.study.report.gallery import figure_of
from vibrissa.study.report.pages import write_picture
from vibrissa.study.run.parts import do_parts
from vibrissa.study.spec.settings import read_study
from vibrissa.study.stages.figure_table import figures_of
from vibrissa.study.stages.stages import expected
from vibrissa.study.store.run_state import Run
from vibrissa.study.store.source import source_digest
from vibrissa.sweep.engine import Engine, staffed
from vibrissa.sweep.threads import single_threaded

OUT = Path(__file__).parents[1] / "vibrissa-out"


def figures():
    """Give number and figure, one after the other."""
    study = read_study()
    with TemporaryDirectory() as folder:
        made = OUT if made_here(study) else run_into(Path(folder), study)
        for entry, _ in figures_of(study, expected(study)):
            yield entry.number, figure_of(entry.number, made)


def made_here(study):
    """Say whether ``vibrissa-out`` holds this experiment, made by this source."""
    about = OUT / "provenance.json"
    if not about.is_file():
        return False
    known = json.loads(about.read_text(encoding="utf-8"))
    return known["source_sha256"] == source_digest() and known["study"]["name"] == study.name


def run_into(folder, study):
    """Run the experiment without its report, and give the folder of its results."""
    with single_threaded(), staffed(Engine()) as engine:
        run = Run(study, folder, folder, engine, lambda *_: None)
        do_parts(run)
        for name, data in run.results.items():
            save(data, run.work / f"{name}.nc")
    return folder


def make(folder):
    """Write the figures into a folder, each with its caption in its metadata."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for number, figure in figures():
        write_picture(figure, folder / f"fig{number}.png")


if __name__ == "__main__":
    make(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "_build/gallery")
