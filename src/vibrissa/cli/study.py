"""The verb `study`, and what `run --dry-run` tells."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from vibrissa.cli.options import Json
from vibrissa.cli.output import show, tell
from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.settings import Study

NOT_ALL = 3  # exit code: the rest is done


def study(
    file: Path | None = None,
    *,
    schema: Annotated[bool, Parameter(negative="")] = False,
    example: Annotated[bool, Parameter(negative="")] = False,
    out: Path | None = None,
    json: Json = False,
) -> None:
    """Check a study file: its parts, and what those that it lacks would give. Or its schema, or one to start from.

    Parameters
    ----------
    file
        Study file (TOML) to be checked.
    schema
        Give the JSON Schema of study files, by which an editor completes keys and marks mistakes.
    example
        Give a study file that runs as it is: the built-in experiment's, with its comments.
    out
        File for the schema (.json) or the example (.toml), instead of the screen.
    """
    if (file is not None) + schema + example != 1:
        raise InputError("study", "must have one thing to do", remedy="a study file, --schema or --example")
    if file is None:
        _give(_schema() if schema else _example(), out, ".json" if schema else ".toml")
        return
    if out is not None:
        raise InputError("--out", "must be left out where a file is checked")
    from vibrissa.study.plan_told import parts_dataset, parts_lines
    from vibrissa.study.settings import read_study

    found = read_study(file)
    if json:
        show(parts_dataset(found), None, json, None)
    else:
        print("\n".join(parts_lines(found)))


def plan_run(study: Study, out: Path, workers: int, json: bool) -> None:
    """Say what a run would do; refuse it, in the end, if an input is missing. Nothing is written."""
    from vibrissa.study.parts import refuse_missing
    from vibrissa.study.plan import plan_study
    from vibrissa.study.plan_told import plan_dataset, plan_lines
    from vibrissa.study.provenance import earlier_results

    plan = plan_study(study, kept=_kept(study, out), workers=workers)
    if json:
        show(plan_dataset(plan), None, json, None)
    else:
        print("\n".join(plan_lines(plan)))
    refuse_missing(plan.inputs)
    earlier_results(study, out)  # refuses a folder with those of another study


def _kept(study: Study, out: Path) -> int:
    """Sweeps of the study that are in the folder of results already."""
    from vibrissa.study.sweeps import FOLDER, kept_sweeps, laboratory_jobs, recorded_jobs

    if not (out / FOLDER).is_dir() or (study.laboratory is None and study.sweeps is None):
        return 0
    if study.laboratory is not None:
        return kept_sweeps(laboratory_jobs(study.laboratory)[0], out)
    return kept_sweeps(recorded_jobs(study.folder / str(study.sweeps))[0], out)


def leave(found: xr.Dataset) -> None:
    """Say what a run could not fit, and what it could not analyse; then the exit code is 3."""
    import json

    for line in json.loads(found.attrs.get("not_fitted", "[]")):
        tell(line[:1].lower() + line[1:].rstrip("."))
    lines = json.loads(found.attrs["not_analysed"])
    for line in lines:
        tell(f"not analysed: {line}")
    if lines:
        sys.exit(NOT_ALL)


def _give(text: str, out: Path | None, suffix: str) -> None:
    from vibrissa.files import written_whole

    if out is None:
        print(text, end="")
        return
    if out.suffix != suffix:
        raise InputError("--out", f"must end in {suffix}", str(out))
    with written_whole(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    tell(f"written: {out}")


def _schema() -> str:
    import json

    from vibrissa.study.schema import study_schema

    return json.dumps(study_schema(), indent=1, ensure_ascii=False) + "\n"


def _example() -> str:
    from importlib import resources

    return resources.files("vibrissa.data").joinpath("experiment.toml").read_text(encoding="utf-8")
