"""The project, as everybody outside this package uses it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.labels import Track
from forcelab.project.adding import add_all
from forcelab.project.arranging import rename, set_task
from forcelab.project.computed import ProjectComputed
from forcelab.project.discarding import discard, remove
from forcelab.project.judged import ProjectJudged
from forcelab.project.loading import id_of, info, infos, load, natural_order
from forcelab.project.recorded import ProjectRecorded
from forcelab.project.records import Added, DemonstrationInfo, Incoming
from forcelab.project.renaming import ProjectRenaming
from forcelab.project.reverting import ProjectReverting
from forcelab.text import unknown_word

__all__ = ["Project"]


class Project(ProjectRenaming, ProjectReverting, ProjectJudged, ProjectComputed, ProjectRecorded):
    """A folder of demonstrations with everybody's labels and every edit ever made.

    Made by :meth:`create` or :meth:`open`; a context manager. Everything is on the disk when a
    method returns, but for :meth:`sync_behind`. Several processes may have one project open; each
    thread opens its own. A demonstration is told by its id, except in :meth:`load`.

    Every method raises :class:`~forcelab.errors.InputError` if the disk is full, the store is
    damaged, or another process keeps it busy for more than five seconds; nothing was written then.

    Attributes
    ----------
    path : Path
        The project's folder.
    """

    def add(
        self, demonstration: Demonstration, tracks: Iterable[Track] = (), source: str = ""
    ) -> Added:
        """Add one demonstration; see :meth:`add_all`.

        Parameters
        ----------
        demonstration, tracks, source
            As of :class:`Incoming`.
        """
        return self.add_all([Incoming(demonstration, tuple(tracks), source)])[0]

    def add_all(self, given: Iterable[Incoming]) -> tuple[Added, ...]:
        """Add demonstrations, or update those with the same content, all or none of them.

        Name, task, rate and video become those given, but for what is to be kept; without a video,
        the one there stays. Where another demonstration of the task has the name, a number is put
        after it. An author's track is imported if there is none or it is as last imported; if it
        was edited since, it stays. Actions that the task's vocabulary lacks are added to it, with
        the looks that were given where these are free.

        Parameters
        ----------
        given : iterable of Incoming
            What is to be added, in this order.

        Returns
        -------
        tuple of Added
            What became of each.

        Raises
        ------
        InputError
            If a video cannot be read or two tracks of a demonstration have one author; nothing was
            added.
        """
        return add_all(self._db, self._tracks, tuple(given))

    def demonstrations(self, task: str | None = None) -> tuple[DemonstrationInfo, ...]:
        """What there is, or what there is of one task, sorted by task and name."""
        return infos(self._db, task)

    def info(self, demonstration: str) -> DemonstrationInfo:
        """What there is of one demonstration, by its id.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        return info(self._db, demonstration)

    def people(self) -> tuple[str, ...]:
        """The people the project knows by name, no models: see :meth:`coders`.

        After who made an edit come those to whom something is assigned, and who wrote a note:
        whoever is to label blind has to be found under the very name that was assigned to.
        """
        assigned = (one.author for one in self.assignments())
        noted = (note.author for note in self.notes())
        return tuple(dict.fromkeys([*self.coders(), *assigned, *noted]))

    def tasks(self) -> tuple[str, ...]:
        """The tasks of all demonstrations, sorted."""
        rows = self._db.all("SELECT DISTINCT task FROM demonstration")
        return tuple(sorted((row["task"] for row in rows), key=natural_order))

    def check_task(self, task: str) -> None:
        """Refuse a task that no demonstration has.

        Raises
        ------
        InputError
            If it is none; the sentence names those that there are.
        """
        known = self.tasks()
        if task not in known:
            raise InputError(unknown_word("task", task, known or ("none at all",)))

    def id_of(self, key: str) -> str:
        """The id of a demonstration, whose files are not looked at.

        Parameters
        ----------
        key : str
            Its id, its name, or the first six or more digits of its id.

        Raises
        ------
        InputError
            If there is none or more than one such demonstration.
        """
        return id_of(self._db, key)

    def load(self, key: str) -> Demonstration:
        """Load a demonstration; its arrays are mapped into memory, read-only.

        Parameters
        ----------
        key : str
            Its id, its name, or the first six or more digits of its id.

        Raises
        ------
        InputError
            If there is none or more than one such demonstration, or a file of it is missing,
            truncated or another one.
        """
        return load(self._db, key)

    def discard(self, demonstration: str, heads: Mapping[str, int]) -> None:
        """Remove a recording that was not worth keeping, for good, with what was marked live.

        Parameters
        ----------
        demonstration : str
            Its id.
        heads : mapping of str to int
            Of each author, the :meth:`head` of the track it was added with.

        Raises
        ------
        InputError
            If there is no such demonstration, or it was labelled, assigned, reviewed or used for
            training or evaluation since: it stays then.
        """
        discard(self._db, demonstration, heads)

    def remove_all(self, heads: Mapping[str, Mapping[str, int]]) -> None:
        """Remove demonstrations for good, with videos, everybody's labels, notes and assignments.

        All or none of them. Runs and recognisers stay; what they were made of cannot be looked up
        any more.

        Parameters
        ----------
        heads : mapping of str to mapping of str to int
            By the id of each, of each coder whose labels may go, the :meth:`head` of the track.

        Raises
        ------
        InputError
            If there is none of one of them, or a coder's labels are others than those: all stay.
        """
        remove(self._db, heads)

    def set_task(self, demonstration: str, task: str) -> None:
        """Put a demonstration into another task; its vocabulary gets the actions it lacks.

        The task that it leaves gives up the actions that came with its import and that no other
        demonstration there has.

        Parameters
        ----------
        demonstration : str
            Its id.
        task : str
            The task, which need not be known; ``""`` for none.

        Raises
        ------
        InputError
            If there is no such demonstration, or another one of the task has its name.
        """
        set_task(self._db, demonstration, task)

    def rename(self, demonstration: str, name: str) -> None:
        """Give a demonstration another name.

        Raises
        ------
        InputError
            If there is no such demonstration, the name is blank, or another demonstration of the
            task has it.
        """
        rename(self._db, demonstration, name)
