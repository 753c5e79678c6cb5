"""Session and animal of a file of Neurodata Without Borders; written whole or not at all."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import h5py

from vibrissa.errors import FormatError, MissingError, RangeError, TooFewError, UnknownError, require_positive
from vibrissa.files import written_whole
from vibrissa.neural.io.formats.nwb import pynwb_module

_BLOCK = 2**24  # bytes by which the file in memory grows

AGE = re.compile(r"P(\d+Y)?(\d+M)?(\d+W)?(\d+D)?")
SPECIES = re.compile(r"[A-Z][a-z]* [a-z]+|http://purl\.obolibrary\.org/obo/NCBITaxon_\d+/?")


@dataclass(frozen=True, kw_only=True)
class Session:
    """Recording session and animal of a file.

    Attributes
    ----------
    identifier : str
        Unique name of the session.
    description : str
        What was done.
    start : datetime
        When the session's clock was 0, with its time zone.
    subject : str
        Name of the animal.
    age : str
        Age in the notation of ISO 8601: ``P90D`` is 90 days.
    sex : str
        M, F, O (other) or U (unknown).
    species : str
        Latin binomial.
    resolution : float
        Least step between spike times, and between samples of waveforms [s].
    probe : str
        What the electrodes are on.
    location : str
        Where they were.
    shanks, sites : int
        Shanks of the probe, and electrodes on each.
    session : str
        Name of the session within the animal; the identifier where it is empty.
    virtual : bool
        Whether the session was simulated: no animal was recorded.
    experimenter : tuple of str
        Who did it, as archives want names: ``Doe, Jane``.
    institution, lab : str
        Where.
    """

    identifier: str
    description: str
    start: datetime
    subject: str
    age: str
    sex: str
    species: str
    resolution: float = 2.5e-5
    probe: str = "silicon probe"
    location: str = "barrel cortex"
    shanks: int = 8
    sites: int = 4
    session: str = ""
    virtual: bool = False
    experimenter: tuple[str, ...] = ()
    institution: str = ""
    lab: str = ""

    def __post_init__(self) -> None:
        for name in ("identifier", "description", "subject"):
            if not getattr(self, name).strip():
                raise TooFewError(f"Session.{name}", "must not be empty")
        for name in ("subject", "session"):
            if "/" in getattr(self, name):
                raise TooFewError(f"Session.{name}", "must not hold a /", repr(getattr(self, name)))
        if not SPECIES.fullmatch(self.species):
            raise FormatError("Session.species", "must be a Latin name of two words", self.species, "Mus musculus")
        if self.start.tzinfo is None:
            raise MissingError("Session.start", "must have a time zone", self.start, "datetime(…, tzinfo=timezone.utc)")
        if self.age == "P" or not AGE.fullmatch(self.age):
            raise FormatError("Session.age", "must be a duration of ISO 8601", repr(self.age), "P90D is 90 days")
        if self.sex not in ("M", "F", "O", "U"):
            raise UnknownError("Session.sex", "must be M, F, O or U", repr(self.sex))
        if self.shanks < 1 or self.sites < 1:
            raise RangeError("Session.shanks and sites", "must be at least 1", (self.shanks, self.sites))
        require_positive("Session.resolution", self.resolution, "s")

    @property
    def filename(self) -> str:
        """Name of the file as archives want it."""
        return self.named("ecephys")

    def named(self, modality: str) -> str:
        """Name of a file of another modality as archives want it: ``behavior``, ``behavior+ecephys``.

        Parameters
        ----------
        modality : str
            What the file holds.

        Returns
        -------
        str
            Name with its suffix.
        """
        subject, session = (re.sub(r"[^A-Za-z0-9-]", "-", name) for name in (self.subject, self._session))
        return f"sub-{subject}_ses-{session}_{modality}.nwb"

    @property
    def _session(self) -> str:
        return self.session or self.identifier


def session_file(session: Session) -> Any:
    """File in memory with a session and its animal, and nothing else yet; pynwb's ``NWBFile``.

    Parameters
    ----------
    session : Session
        Session and animal.

    Returns
    -------
    pynwb.NWBFile
        Not yet on the disk.

    Raises
    ------
    InputError
        If pynwb is not installed.
    """
    pynwb = pynwb_module()
    about = "virtual, no animal was recorded" if session.virtual else f"subject {session.subject}"
    animal = {name: getattr(session, name) for name in ("age", "sex", "species")}
    subject = pynwb.file.Subject(subject_id=session.subject, description=about, **animal)
    known = {"experimenter": list(session.experimenter), "institution": session.institution, "lab": session.lab}
    return pynwb.NWBFile(
        session_description=session.description,
        experiment_description=session.description,
        identifier=session.identifier,
        session_id=session._session,
        session_start_time=session.start,
        subject=subject,
        keywords=["whisker", "texture", *(["virtual data", "simulation"] if session.virtual else [])],
        **{name: one for name, one in known.items() if one},
    )


def nwb_bytes(file: Any) -> bytes:
    """Content of the file on the disk of a file of pynwb.

    It is built in memory: the HDF5 library crashes where a disk fills up under it.

    Parameters
    ----------
    file : pynwb.NWBFile
        The file.

    Returns
    -------
    bytes
        HDF5.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        memory = h5py.File(file.identifier, "w", driver="core", backing_store=False, block_size=_BLOCK)
        with memory, pynwb_module().NWBHDF5IO(file=memory, mode="w") as io:
            io.write(file)
            memory.flush()
            return bytes(memory.id.get_file_image())


def save_nwb(file: Any, path: str | Path) -> None:
    """Write a file of pynwb, whole or not at all.

    Parameters
    ----------
    file : pynwb.NWBFile
        The file.
    path : path
        Its name; one that is there is replaced.

    Raises
    ------
    InputError
        As :func:`vibrissa.files.written_whole`.
    """
    content = nwb_bytes(file)
    with written_whole(path) as temporary:
        temporary.write_bytes(content)
