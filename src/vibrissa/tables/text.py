"""Lines of a text and numbers of its cells."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from vibrissa.errors import FormatError
from vibrissa.files import existing

LONGEST = 1 << 24  # characters of a line
WIDEST = 100_000  # cells of a line
BLANK = 100_000  # lines without content, one after the other


def each_line(path: str | Path) -> Iterator[tuple[int, str]]:
    """Lines of a UTF-8 text that are neither blank nor a comment (``#``), one by one, each with its number in the file.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    iterator of (int, str)
        Number from 1, and line with its end.

    Raises
    ------
    InputError
        If there is no such file, or it cannot be read, or is no text.
    """
    blank = 0
    with _opened(path, errors="strict") as file:
        for number, line in enumerate(iter(lambda: file.readline(LONGEST), ""), 1):
            if len(line) == LONGEST:
                longest = f"must have lines of fewer than {LONGEST} characters"
                raise FormatError(f"{path}, line {number}", longest, repr(line[:20]), "save it as CSV, UTF-8")
            if line.count(",") + line.count(";") >= WIDEST:
                rule = f"must have lines of at most {WIDEST:,} cells"
                raise FormatError(f"{path}, line {number}", rule, repr(line[:20]), "a table has a row for each sample")
            blank = blank + 1 if line.isspace() else 0
            if blank > BLANK:
                raise FormatError(f"{path}, line {number}", f"must follow at most {BLANK:,} blank lines")
            if (text := line.lstrip()) and text[0] != "#":
                yield number, line


def first_line(path: str | Path) -> str:
    """First line of any file that is neither blank nor a comment; nothing where that is no text.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    str
        Of the first 4,096 bytes.

    Raises
    ------
    InputError
        If there is no such file, or it cannot be read.
    """
    with _opened(path, errors="replace") as file:
        opening = file.read(4096).splitlines()
    return next((line for line in opening if line.strip() and not line.lstrip().startswith("#")), "")


def header_names(line: str, others: str = ";\t") -> list[str]:
    """Names of the columns, were a line the header of a table; without the quotes that other programs put about them.

    Parameters
    ----------
    line : str
        The first line of any file.
    others : str
        Signs besides the comma that may separate columns.

    Returns
    -------
    list of str
        Without spaces around them.
    """
    cells = next(csv.reader([line]), [])
    return [name.strip().strip('"') for cell in cells for name in (re.split(f"[{others}]", cell) if others else [cell])]


@contextmanager
def _opened(path: str | Path, errors: str) -> Iterator[TextIO]:
    try:
        with open(existing(path), encoding="utf-8-sig", errors=errors) as file:
            yield file
    except OSError as error:
        raise FormatError(str(path), f"could not be read ({error.strerror or error})") from error
    except UnicodeDecodeError as error:
        raise FormatError(str(path), f"must be text ({error})", remedy="save it as CSV, UTF-8") from error


def as_number(cell: str) -> float:
    """Value of a cell; NaN where it is no number (nor ``1_0``, which Python would read as ten).

    Parameters
    ----------
    cell : str
        Text of the cell.

    Returns
    -------
    float
        Its value.
    """
    try:
        return float("nan" if "_" in cell else cell)
    except ValueError:
        return float("nan")
