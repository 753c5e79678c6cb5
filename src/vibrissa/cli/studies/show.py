"""The verb `show`: what any file is."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.cli.shared.display.output import Json, MaybeOut, print_json, say, tell
from vibrissa.cli.shared.display.pictures import refuse_picture, write_picture
from vibrissa.cli.shared.display.tables import folded, hanging
from vibrissa.cli.shared.options import Flag
from vibrissa.cli.shared.words.losses import lost_by_reason
from vibrissa.errors import ConflictError

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr


def show(file: Path, *, plot: Flag = False, out: MaybeOut = None, json: Json = False) -> None:
    """Describe any file: dataset, table, surface, movie, NWB session, study, folder of results.

    Parameters
    ----------
    file
        The file or folder.
    plot
        Draw it too.
    out
        Picture to draw (.png, .pdf or .svg); FILE's name with .png in the current folder by default.
    """
    if out is not None and not plot:
        raise ConflictError("--out", "must go with --plot", str(out))
    picture = out or Path(f"{file.absolute().stem}.png")
    if plot:
        refuse_picture(picture, "--out")
        if picture.exists() and picture.samefile(file):
            raise ConflictError("--plot", "must not replace the file", str(picture), "name another picture with --out")
    from vibrissa.study.run.contents import contents

    found = contents(file)
    if json:
        print_json({"kind": found.kind, "facts": found.facts, "variables": _variables(found.data)})
    else:
        say([f"{file.absolute().name}: {found.kind}", *hanging([_line(*fact) for fact in found.facts.items()])])
        say(_table(found.data))
    if plot:
        _draw(found.kind, found.data, picture)


def _draw(kind: str, data: xr.Dataset | None, picture: Path) -> None:
    if data is None:
        raise ConflictError("--plot", f"must be left out: nothing of a {kind} can be drawn")
    from vibrissa.figures.others import contents, scan

    figure = scan if kind.startswith("predicted scan") and "mode_sd" in data else contents
    write_picture(figure.draw(figure.compute(data)), picture)
    tell(f"the picture is {picture}")


def _line(name: str, value: Any) -> str:
    try:
        whole = WHOLE[name](json_text.loads(value))
    except (KeyError, TypeError, ValueError):  # another attribute, or that name in a file of another program
        whole = None
    text = f"{value:.6g}" if isinstance(value, float) else " ".join(str(value).split())
    return f"  {name}  {whole or (text if len(text) < 200 else text[:200] + ' …')}".rstrip()


def _lost(whiskers: list[list[tuple[int, int, str]]]) -> str:
    """In how many frames each whisker is lost, and mostly why."""
    said = []
    for whisker, runs in enumerate(whiskers):
        if runs:
            lost = lost_by_reason(runs)
            said.append(f"whisker {whisker} in {lost.total()} frames, mostly: {lost.most_common(1)[0][0]}")
    return "; ".join(said) or "no whisker in any frame"


WHOLE: dict[str, Callable[[Any], str]] = {"lost": _lost, "remarks": "; ".join}  # attributes (JSON) that are not cut


def _variables(data: xr.Dataset | None) -> list[dict[str, Any]]:
    if data is None:
        return []
    return [
        {
            "name": str(name),
            "dimensions": [str(dim) for dim in one.dims],
            "units": one.attrs.get("units", "1"),
            "long_name": one.attrs.get("long_name", ""),
        }
        for name, one in data.variables.items()
    ]


def _table(data: xr.Dataset | None) -> list[str]:
    """Variables with their dimensions, unit and meaning, a line each."""
    import shutil

    rows = _variables(data)
    if not rows:
        return []
    key = ["variable", *(row["name"] for row in rows)]
    columns = [
        ["dimensions", *(", ".join(row["dimensions"]) for row in rows)],
        ["unit", *("" if row["units"] == "1" else row["units"] for row in rows)],
        ["meaning", *(row["long_name"] for row in rows)],
    ]
    return ["", *folded(key, columns, shutil.get_terminal_size().columns)]
