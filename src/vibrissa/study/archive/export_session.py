"""Details of a session that an archive requires and results do not hold: the animal, its age, the day."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa import __version__
from vibrissa.errors import ConflictError, FormatError, MissingError
from vibrissa.neural.io.formats.nwb_session import Session
from vibrissa.study.archive.export_folder import BASE
from vibrissa.study.archive.export_units import simulated, tables_of_units
from vibrissa.tables.reader import read_table
from vibrissa.tables.units import TEXT

if TYPE_CHECKING:
    import xarray as xr

FIELDS = ("subject", "age", "sex", "start", "species", "name", "description", "institution", "lab")
COLUMNS = {"session": "name"} | {field: field for field in FIELDS if field != "name"}
ASKED = {
    "subject": "name of the animal, or of the robot",
    "age": "P90D is 90 days",
    "sex": "M, F, O (other) or U (unknown)",
    "species": "Latin name, such as Mus musculus",
    "start": "when the clock was 0, with its zone: 2014-05-07T09:30:00+02:00",
}

OfAnimals = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True, kw_only=True)
class SessionDetails:
    """What only the experimenter knows, as words; None where it is not given.

    Attributes
    ----------
    subject : str
        Name of the animal; by default that of the table of sweeps.
    age : str
        ``P90D`` is 90 days.
    sex : str
        M, F, O or U.
    start : str
        When the session's clock was 0: date and time of ISO 8601 with a zone.
    species : str
        Latin binomial.
    name : str
        Of the session; by default that of the folder.
    description : str
        What was done; by default what the results say.
    experimenter : tuple of str
        Who did it: ``Doe, Jane``.
    institution, lab : str
        Where.
    """

    subject: str | None = None
    age: str | None = None
    sex: str | None = None
    start: str | None = None
    species: str | None = None
    name: str | None = None
    description: str | None = None
    experimenter: tuple[str, ...] = ()
    institution: str | None = None
    lab: str | None = None

    def session(self, animal: str | None, parts: Mapping[str, xr.Dataset], folder: Path, animals: OfAnimals) -> Session:
        """Session of one animal's file.

        Parameters
        ----------
        animal : str or None
            Its name in the table of sweeps.
        parts : mapping of Datasets
            What the file will hold.
        folder : Path
            Of the results.
        animals : mapping
            Details of single animals.

        Returns
        -------
        Session
            With every field that the format requires.

        Raises
        ------
        InputError
            Names the options that are missing, or what is wrong with those given.
        """
        known: dict[str, Any] = {**animals.get(animal or self.subject or "", {})}
        own = replace(self, **known)
        subject = own.subject or animal
        given = {"subject": subject} | {name: getattr(own, name) for name in ("age", "sex", "species", "start")}
        if missing := [name for name, value in given.items() if not value]:
            options, whose = ", ".join(missing), f" for {subject}" if subject else ""
            remedy = "; ".join(f"{name}: {ASKED[name]}" for name in missing)
            raise MissingError(options, f"must be given{whose}", remedy=remedy)
        name = own.name or folder.resolve().name
        virtual, real = virtual_and_real(parts)
        return Session(
            identifier=f"{subject} {name}",
            session=name,
            description=_description(own.description, virtual, real),
            start=_moment(str(own.start)),
            subject=str(subject),
            age=str(own.age),
            sex=str(own.sex),
            species=str(own.species),
            virtual=bool(virtual) and not real,
            experimenter=own.experimenter,
            institution=own.institution or "",
            lab=own.lab or "",
        )


def virtual_and_real(parts: Mapping[str, xr.Dataset]) -> tuple[list[str], list[str]]:
    """What of the results was simulated, and what was recorded.

    Parameters
    ----------
    parts : mapping of Datasets
        Of one animal.

    Returns
    -------
    virtual, real : list of str
        In words.
    """
    kinds = {
        "sweeps": ("sweeps" in parts, "laboratory" in parts["sweeps"].attrs if "sweeps" in parts else False),
        "the movie": ("sweeps" not in parts and bool({"profile", "modal"} & set(parts)), "true_profile" in parts),
        "base signals": (any(BASE.fullmatch(name) for name in parts), False),
        "units": ("spikes" in parts or bool(tables_of_units(parts)), simulated(parts)),
        "a scan": ("scan" in parts, True),
    }
    virtual, real = ([name for name, one in kinds.items() if one == (True, wanted)] for wanted in (True, False))
    return virtual, real


def read_animals(path: str | Path) -> dict[str, dict[str, str]]:
    """Details of each animal.

    Parameters
    ----------
    path : path
        CSV with the columns ``animal``, its name in the table of sweeps, and any of ``subject``, ``age``, ``sex``,
        ``start``, ``species``, ``session``, ``description``, ``institution`` and ``lab``; an empty cell
        leaves it to the options.

    Returns
    -------
    dict
        Name in the table of sweeps → details by field.

    Raises
    ------
    InputError
        Names file and line: unknown columns, an animal that occurs twice.
    """
    table = read_table(path, {"animal": TEXT}, dict.fromkeys(COLUMNS, TEXT), others=False)
    animals: dict[str, dict[str, str]] = {}
    for here, row in table.rows():
        animal = row.pop("animal")
        if animal in animals:
            raise ConflictError(f"{here}, animal", "must name an animal that no line before it names", repr(animal))
        animals[animal] = {COLUMNS[column]: cell for column, cell in row.items() if cell}
    return animals


def _moment(text: str) -> datetime:
    """Date and time with a zone, not in the future."""
    try:
        start = datetime.fromisoformat(text)
    except ValueError as error:
        raise FormatError("start", "must be date and time of ISO 8601", repr(text), ASKED["start"]) from error
    if not re.match(r"\S+[T ]\d\d", text):
        raise MissingError("start", "must have a time of day and its zone", repr(text), ASKED["start"])
    if start.tzinfo is None:
        raise MissingError("start", "must have a time zone", repr(text), f"{text}+00:00, if it was UTC")
    if start > datetime.now(UTC):
        raise ConflictError("start", "must not lie in the future", repr(text))
    return start


def _description(given: str | None, virtual: list[str], real: list[str]) -> str:
    made = f"vibrissa {__version__}"
    text = given or f"Whiskers and what they feel: {', '.join([*real, *virtual]) or 'results'}; analysed with {made}."
    if not virtual:
        return text
    if not real:
        return f"VIRTUAL DATA, simulated with {made}; no animal was recorded. {text}"
    return f"VIRTUAL DATA among it, simulated with {made}: {', '.join(virtual)}. {text}"
