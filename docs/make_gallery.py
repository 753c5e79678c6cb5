"""Make the figures of the gallery from the built-in experiment.

python docs/make_gallery.py [FOLDER]

By the same calls as ``vibrissa run``, without its report, and ``vibrissa figure``.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from vibrissa.netcdf import save
from vibrissa.study.report.gallery import figure_of
from vibrissa.study.report.pages import write_picture
from vibrissa.study.run.parts import do_parts
from vibrissa.study.spec.settings import read_study
from vibrissa.study.stages.figure_table import figures_of
from vibrissa.study.store.run_state import Run
from vibrissa.sweep.engine import Engine, staffed
from vibrissa.sweep.threads import single_threaded


def figures():
    """Give number and figure, one after the other."""
    with TemporaryDirectory() as folder, single_threaded(), staffed(Engine()) as engine:
        run = Run(read_study(), Path(folder), Path(folder), engine, lambda *_: None)
        do_parts(run)
        for name, data in run.results.items():
            save(data, run.work / f"{name}.nc")
        for entry, _ in figures_of(run.study, run.results):
            yield entry.number, figure_of(entry.number, folder)


def make(folder):
    """Write the figures into a folder, each with its caption in its metadata."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for number, figure in figures():
        write_picture(figure, folder / f"fig{number}.png")


if __name__ == "__main__":
    make(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "_build/gallery")
