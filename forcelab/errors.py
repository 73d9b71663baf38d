"""The errors a user can cause: one sentence each, saying what, where and the cure."""

from __future__ import annotations

__all__ = [
    "ForcelabError",
    "InputError",
    "StaleTrackError",
    "UnclearAuthorError",
    "UnclearRateError",
]


class ForcelabError(Exception):
    """Something the user can mend; its text is one complete sentence.

    The command line prints the sentence and ends with exit status 1; the window shows it once.
    """


class InputError(ForcelabError):
    """A file, a project or a setting that cannot be used as it is."""


class UnclearAuthorError(InputError):
    """Several coders labelled and none was chosen; whoever tells it adds how to choose one."""


class UnclearRateError(InputError):
    """A recording does not tell its rate; whoever tells it adds how to say that."""


class StaleTrackError(ForcelabError):
    """A track was changed by somebody else since it was read; nothing was written."""
