"""A project's folder: made, opened, held still and closed; what is in it is not looked at."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

from forcelab.errors import InputError
from forcelab.project import files
from forcelab.project.database import FILE, Database
from forcelab.project.loading import DEMONSTRATIONS, known_ids
from forcelab.project.runs import RECOGNISERS, clear_recognisers

__all__ = ["ProjectFolder"]

#: Seconds to wait while another process writes.
BUSY_TIMEOUT = 5.0

Self = TypeVar("Self", bound="ProjectFolder")


class ProjectFolder:
    """The folder and the open store of a :class:`~forcelab.project.Project`."""

    def __init__(self, path: Path, database: Database) -> None:
        self.path = path
        self._db = database

    @staticmethod
    def vacant(path: str | os.PathLike[str]) -> bool:
        """Whether a new project can be made there: nothing exists, or an empty folder.

        Raises
        ------
        InputError
            If the folder cannot be looked at.
        """
        with files.told(f"'{path}' cannot be opened"):
            return files.vacant(Path(path))

    @staticmethod
    def is_at(path: str | os.PathLike[str]) -> bool:
        """Whether a folder is that of a project, be it damaged or of another version."""
        with contextlib.suppress(OSError):  # what cannot be looked at cannot be told
            return (Path(path) / FILE).is_file()
        return False

    @classmethod
    def create(cls: type[Self], path: str | os.PathLike[str]) -> Self:
        """Make a new project and open it.

        Parameters
        ----------
        path : path-like
            The folder to make, by custom ``NAME.forcelab``; may exist if it is empty.

        Raises
        ------
        InputError
            If there is something already, or the folder cannot be made.
        """
        with cls.creating(path):
            pass
        return cls.open(path)

    @classmethod
    @contextlib.contextmanager
    def creating(cls: type[Self], path: str | os.PathLike[str]) -> Iterator[Self]:
        """Make a new project that appears under its name once the block has filled it.

        Nothing is left of it if the block raises. Parameters and errors are those of
        :meth:`create`.
        """
        path = Path(path).absolute()
        refused = f"'{path}' cannot become a new project"
        if not cls.vacant(path):
            what = "the folder is not empty" if path.is_dir() else "it is a file"
            raise InputError(f"{refused}: {what}; choose another name.")
        if not path.parent.is_dir():
            raise InputError(f"{refused}: there is no folder '{path.parent}'; make it first.")
        part = path
        try:
            with files.told(refused), files.appearing(path) as part:
                (part / DEMONSTRATIONS).mkdir()
                (part / RECOGNISERS).mkdir()
                Database.create(part)
                with cls.open(part) as project:
                    if project.read_only:  # its tables are in memory alone
                        raise InputError(
                            f"{refused}: no more can be written there; make room on the disk or "
                            "check it."
                        )
                    yield project
        except InputError as error:  # in the name that the user knows
            raise InputError(str(error).replace(str(part), str(path))) from error

    @classmethod
    def open(cls: type[Self], path: str | os.PathLike[str], timeout: float = BUSY_TIMEOUT) -> Self:
        """Open a project.

        An older version's is brought up to date; what killed imports left behind is cleared away.

        Parameters
        ----------
        path : path-like
            The project's folder.
        timeout : float
            Seconds to wait while another process writes.

        Raises
        ------
        InputError
            If that is no project, a damaged one or one of a newer version; it stays untouched.
        """
        folder = Path(path).absolute()
        project = cls(folder, Database(folder, timeout))
        try:
            with files.told(f"'{folder}' cannot be opened"):
                for name in (DEMONSTRATIONS, RECOGNISERS):
                    files.check_folder(folder / name)
                if not project.read_only:
                    _clear_away(project._db)
        except BaseException:
            project.close()
            raise
        return project

    @property
    def read_only(self) -> bool:
        """Whether nothing of it may be changed here, as on a backup or another's share."""
        return self._db.read_only

    def refuse_read_only(self) -> None:
        """Make sure that it may be changed here, before the work for it is done.

        Raises
        ------
        InputError
            If it is :attr:`read_only`.
        """
        self._db.refuse_read_only()

    def close(self) -> None:
        """Let go of the store; nothing more can be asked."""
        self._db.close()

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def changed_elsewhere(self) -> bool:
        """Whether another process or thread has written since this was asked, or since opening.

        Takes some microseconds, so that a window may ask every second. What was written through
        this object does not count.
        """
        return self._db.changed_elsewhere()

    @contextlib.contextmanager
    def snapshot(self) -> Iterator[None]:
        """Reading inside this block shows one moment, whatever other processes commit.

        Raises
        ------
        RuntimeError
            If the project is changed inside the block, which is a mistake of the program.
        """
        with self._db.reading():
            yield


def _clear_away(database: Database) -> None:
    """Delete what killed processes left behind."""
    for parent in (database.folder / DEMONSTRATIONS, database.folder / RECOGNISERS):
        parent.mkdir(exist_ok=True)
        if files.leftovers(parent, known_ids(database)):
            with database.writing():
                for path in files.leftovers(parent, known_ids(database)):
                    files.remove(path)
    clear_recognisers(database)
