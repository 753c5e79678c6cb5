"""The verb `study`: a study file checked, its schema, or one to start from."""

from __future__ import annotations

import json as json_text
from importlib.resources import files
from pathlib import Path

from vibrissa.cli.shared.display.output import Json, MaybeOut, say, show, tell
from vibrissa.cli.shared.display.tables import hanging
from vibrissa.cli.shared.options import Flag
from vibrissa.errors import ConflictError, FormatError

_EXAMPLE = files("vibrissa.data") / "experiment.toml"


def study(
    file: Path | None = None,
    *,
    schema: Flag = False,
    example: Flag = False,
    out: MaybeOut = None,
    json: Json = False,
) -> None:
    """Check a study file, and list its parts and those that it lacks; or print the schema, or an example.

    Parameters
    ----------
    file
        Study file (TOML) to be checked.
    schema
        Print the JSON Schema of study files, by which an editor completes keys and marks mistakes.
    example
        Print a study file that runs as it is: the built-in experiment's, with its comments.
    out
        File for the schema (.json) or the example (.toml), instead of the screen.
    """
    if (file is not None) + schema + example != 1:
        raise ConflictError("study", "must be one of: a study file, --schema, --example")
    if file is None:
        return _give_schema(out) if schema else _give(_EXAMPLE.read_text(encoding="utf-8"), out, ".toml")
    if out is not None:
        raise ConflictError("--out", "must be left out where a file is checked")
    from vibrissa.study.run.plan_summary import parts_dataset, parts_lines
    from vibrissa.study.spec.settings import read_study

    found = read_study(file)
    return show(parts_dataset(found), json=True) if json else say(hanging(parts_lines(found)))


def _give_schema(out: Path | None) -> None:
    from vibrissa.study.spec.schema import study_schema

    _give(json_text.dumps(study_schema(), indent=1, ensure_ascii=False) + "\n", out, ".json")


def _give(text: str, out: Path | None, suffix: str) -> None:
    from vibrissa.files import written_whole

    if out is None:
        print(text, end="")
        return
    if out.suffix != suffix:
        raise FormatError("--out", f"must end in {suffix}", str(out))
    with written_whole(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    tell(f"written: {out}")
