"""The errors a user can cause: one sentence each, saying what, where and the cure."""

from __future__ import annotations

from pathlib import Path


class ForcelabError(Exception):
    """Something the user can mend; its text is one complete sentence.

    The command line prints the sentence and ends with exit status 1; the window shows it once.

    Examples
    --------
    >>> try:
    ...     project.demonstrations.load("nobody")
    ... except forcelab.ForcelabError as error:
    ...     print(error)
    There is no demonstration 'nobody'...
    """


class InputError(ForcelabError):
    """A file, a project or a setting that cannot be used as it is.

    Attributes
    ----------
    files : tuple of Path
        Which of several files cannot be used, where that is known.

    Examples
    --------
    >>> try:
    ...     forcelab.Segment(2.0, 1.0, "grab")
    ... except forcelab.InputError as error:
    ...     print(error)
    A segment must end after it starts; 'grab' goes from 2.0 s to 1.0 s.
    """

    files: tuple[Path, ...] = ()


class UnclearAuthorError(InputError):
    """Several coders labelled and none was chosen; whoever tells it adds how to choose one."""


class UnclearRateError(InputError):
    """A recording does not tell its rate; whoever tells it adds how to say that."""


class StoreBusyError(InputError):
    """Another program keeps a project's store busy; nothing was read or written."""


class StaleTrackError(ForcelabError):
    """A track was changed by somebody else since it was read; nothing was written."""
