"""The project: one folder, one SQLite store, and every edit ever made."""

from __future__ import annotations

import contextlib
import sqlite3
from collections import Counter
from collections.abc import Iterator
from os import PathLike
from pathlib import Path

from forcelab.errors import InputError
from forcelab.labels import is_model
from forcelab.notebook import html_table, html_title
from forcelab.project import files
from forcelab.project.actions import ActionStore
from forcelab.project.coding import CodingStore
from forcelab.project.database import FILE, Database
from forcelab.project.demonstrations import DemonstrationStore
from forcelab.project.files import DEMONSTRATIONS, RECOGNISERS
from forcelab.project.media import MediaStore
from forcelab.project.records import DemonstrationInfo
from forcelab.project.runs import RunStore
from forcelab.project.tracks import TrackStore
from forcelab.text import counted, task_text

#: Seconds to wait while another process writes.
BUSY_TIMEOUT = 5.0


class Project:
    """A folder of demonstrations with everybody's labels and every edit ever made.

    Made by :meth:`create` or :meth:`open`; a context manager. Everything is on the disk when a
    method returns, but for :meth:`sync_behind`. Several processes may have one project open; each
    thread opens its own. A demonstration is named by its id, except in ``demonstrations.load`` and
    ``demonstrations.id_of``.

    Every method of its parts raises :class:`~forcelab.errors.InputError` if it is given a
    demonstration that there is not, the disk is full, the store is damaged, or another process
    keeps it busy for more than five seconds; nothing was written then.

    Attributes
    ----------
    path : Path
        The project's folder.
    demonstrations : DemonstrationStore
        Recordings: added, listed, loaded, renamed, removed.
    media : MediaStore
        Their videos, cameras and raw time stamps.
    tracks : TrackStore
        Labels by author, edits, undo and history.
    actions : ActionStore
        The actions of each task, and renaming them.
    coding : CodingStore
        Coders, assignments, notes and verdicts.
    runs : RunStore
        Evaluations and recognisers, with all it takes to repeat them.

    Examples
    --------
    >>> with forcelab.Project.open("lab.forcelab") as lab:
    ...     [info.name for info in lab.demonstrations.infos("foam")]
    ['foam 01', 'foam 02', 'foam 03', 'foam 04']
    """

    def __init__(self, path: Path, database: Database) -> None:
        self.path = path
        self._db = database
        self.runs = RunStore(database)
        self.coding = CodingStore(database)
        self.tracks = TrackStore(database)
        self.actions = ActionStore(database, self.tracks, self.coding)
        self.media = MediaStore(database)
        self.demonstrations = DemonstrationStore(database, self.tracks, self.actions, self.coding)

    @staticmethod
    def vacant(path: str | PathLike[str]) -> bool:
        """Whether a new project can be made there: nothing exists, or an empty folder.

        Raises
        ------
        InputError
            If the folder cannot be looked at.
        """
        with files.file_errors(f"'{path}' cannot be opened"):
            folder = Path(path)
            return not folder.exists() or (folder.is_dir() and not any(folder.iterdir()))

    @staticmethod
    def is_at(path: str | PathLike[str]) -> bool:
        """Whether a folder is that of a project, be it damaged or of another version."""
        with contextlib.suppress(OSError):  # what cannot be looked at cannot be told
            return (Path(path) / FILE).is_file()
        return False

    @classmethod
    def create(cls, path: str | PathLike[str]) -> Project:
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
    def creating(cls, path: str | PathLike[str]) -> Iterator[Project]:
        """Make a new project that appears under its name once the block has filled it.

        Nothing is left of it if the block raises. Parameters and errors are those of
        :meth:`create`.
        """
        path = Path(path).absolute()
        refused = f"'{path}' cannot become a new project"
        if not cls.vacant(path):
            obstacle = "the folder is not empty" if path.is_dir() else "it is a file"
            raise InputError(f"{refused}: {obstacle}; choose another name.")
        if not path.parent.is_dir():
            raise InputError(f"{refused}: there is no folder '{path.parent}'; make it first.")
        part = path
        try:
            with files.file_errors(refused), files.appearing(path) as part:
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
    def open(cls, path: str | PathLike[str], timeout: float = BUSY_TIMEOUT) -> Project:
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
            with files.file_errors(f"'{folder}' cannot be opened"):
                for name in (DEMONSTRATIONS, RECOGNISERS):
                    files.check_folder(folder / name)
                if not project.read_only:
                    project._clear_away()
        except BaseException:
            project.close()
            raise
        return project

    @property
    def read_only(self) -> bool:
        """Whether nothing of it may be changed here, as on a backup or another's share."""
        return self._db.read_only

    def refuse_read_only(self) -> None:
        """Raise InputError if it is :attr:`read_only`, before the work for a change is done."""
        self._db.refuse_read_only()

    def close(self) -> None:
        """Close the store; nothing more can be read."""
        self._db.close()

    def __repr__(self) -> str:
        return f"Project('{self.path}')"

    def _repr_html_(self) -> str:
        """As notebooks show it: a row for each task."""
        tasks: dict[str, list[DemonstrationInfo]] = {}
        try:
            infos, runs = self.demonstrations.infos(), len(self.runs.summaries())
        except sqlite3.ProgrammingError:
            return html_title(self.path.stem, "closed")
        for info in infos:
            tasks.setdefault(info.task, []).append(info)
        rows = []
        for task, of_task in tasks.items():
            coders = Counter(coder for info in of_task for coder in _coders(info))
            labelled = ", ".join(f"{coder} ({number})" for coder, number in coders.items())
            minutes = sum(info.duration for info in of_task) / 60
            rows.append([task_text(task), len(of_task), f"{minutes:.1f}", labelled])
        title = html_title(self.path.stem, counted(runs, "run"))
        return title + html_table(["task", "demonstrations", "minutes", "labelled by"], rows)

    def __enter__(self) -> Project:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def changed_elsewhere(self) -> bool:
        """Whether another process or thread has written since this was asked, or since opening.

        Takes some microseconds, so that a window may ask every second. What was written through
        this object does not count.
        """
        return self._db.changed_elsewhere()

    def snapshot(self) -> contextlib.AbstractContextManager[None]:
        """Reading inside this block shows one moment, whatever other processes commit.

        Raises
        ------
        RuntimeError
            If the project is changed inside the block, which is a mistake of the program.
        """
        return self._db.reading()

    def sync_behind(self) -> None:
        """Let edits return before the disk has them, for a coder who paints one after the other.

        From now on what a method stored is safe from this process being killed, and a moment later
        from a power cut as well.
        """
        self._db.sync_behind()

    def _clear_away(self) -> None:
        """Delete what killed processes left behind."""
        for name in (DEMONSTRATIONS, RECOGNISERS):
            parent = self.path / name
            parent.mkdir(exist_ok=True)
            if files.leftovers(parent, self._db.demonstration_ids()):
                with self._db.writing():
                    for path in files.leftovers(parent, self._db.demonstration_ids()):
                        files.remove(path)
        self.runs.clear_uncommitted()


def _coders(info: DemonstrationInfo) -> list[str]:
    """The people who labelled anything of a demonstration."""
    return [name for name, seconds in info.labelled.items() if seconds and not is_model(name)]
