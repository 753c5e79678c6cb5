"""Files: those that are read are files, those that are written are whole or not there."""

from __future__ import annotations

import hashlib
import os
import platform
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from vibrissa.errors import ConflictError, MachineError, MissingError


def existing(path: str | Path) -> Path:
    """Give the path of a file that is there.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    Path
        The same.

    Raises
    ------
    MissingError
        If no file is there.
    """
    if not Path(path).is_file():
        raise MissingError(str(path), "must be an existing file")
    return Path(path)


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """Give a temporary name beside ``path``; rename it to ``path`` when all went well, else remove it.

    The temporary name keeps the suffix, by which writers choose their format.

    Parameters
    ----------
    path : path
        Name of the file; its folder exists.

    Returns
    -------
    iterator of Path
        One name, of a file that does not exist yet.

    Raises
    ------
    InputError
        If the folder does not exist; :class:`~vibrissa.errors.MachineError` if the disk is full.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise MissingError(str(path.parent), "must be an existing folder", remedy="make it, or choose another")
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.{secrets.token_hex(4)}.part{path.suffix}")
    with _writing(path):
        try:
            yield temporary
            with open(temporary, "rb+") as written:
                os.fsync(written.fileno())  # else a power cut may leave the name without the content
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise MachineError(str(path), f"could not be written ({error.strerror or error})") from error


@contextmanager
def held(folder: str | Path) -> Iterator[Path]:
    """Hold a folder of results, which need not exist yet, for this process alone; gives an empty folder beside it.

    The caller writes its results into the empty folder, and moves them when they are whole. That folder and a lock
    beside it are removed in the end; those that a killed process left are taken over. Both are in the folder itself
    where another disk is mounted there: files are only moved within a disk.

    Parameters
    ----------
    folder : path
        Of the results.

    Returns
    -------
    iterator of Path
        The empty folder.

    Raises
    ------
    InputError
        If another process holds it, or its parent does not exist or cannot be written.
    """
    folder = Path(folder).absolute()
    if not folder.parent.is_dir():
        raise MissingError(str(folder.parent), "must be an existing folder", remedy="make it, or choose another `out`")
    if folder.exists() and not folder.is_dir():
        raise MissingError(str(folder), "must be a folder", remedy="choose another `out`")
    work = _beside(folder, "part")
    with _writing(folder), _locked(folder):
        try:
            shutil.rmtree(work, ignore_errors=True)
            work.mkdir()
            yield work
        finally:
            shutil.rmtree(work, ignore_errors=True)


def _beside(folder: Path, part: str) -> Path:
    """Hidden name next to a folder, or in it if another disk is mounted there."""
    name = f".{folder.name}.{part}"
    return folder / name if folder.is_mount() else folder.with_name(name)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Lock a file beside a folder; the system lets go of it when this process ends, whatever ends it."""
    from filelock import FileLock, Timeout

    lock, holder = (_beside(folder, part) for part in ("lock", "holder"))
    taken = FileLock(lock, blocking=False)
    try:
        taken.acquire()
    except Timeout as error:
        if not lock.exists():
            rule = "must lie where files can be made"
            raise MissingError(str(folder), rule, remedy="choose another `out`") from error
        who = "another run's"
        with suppress(OSError):
            who = holder.read_text(encoding="utf-8") or who
        raise ConflictError(str(folder), "must not be in use", who, "wait for it, or choose another `out`") from error
    try:
        holder.write_text(f"process {os.getpid()} on {platform.node()}", encoding="utf-8")
        yield
    finally:
        holder.unlink(missing_ok=True)
        with suppress(PermissionError):  # where an open file cannot be removed it stays, locked by no one
            lock.unlink(missing_ok=True)
        taken.release()


def digest(path: str | Path) -> str:
    """SHA-256 of a file, or of all files in and below a folder with their names; nothing where it cannot be read.

    Parameters
    ----------
    path : path
        A file or a folder.

    Returns
    -------
    str
        64 digits, or nothing.
    """
    path = Path(path)
    if path.is_dir():
        files = sorted(part for part in path.rglob("*") if part.is_file())
        parts = [f"{part.relative_to(path).as_posix()} {digest(part)}" for part in files]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""
