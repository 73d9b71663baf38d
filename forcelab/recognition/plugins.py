"""Classifiers and features from outside forcelab: functions named by their import paths.

Settings, and so runs and files of recognisers, hold the path alone, ``mylab.models:make_forest``.
It is their origin, and text: it is imported only where whoever runs this program has named the same
path. A project or a recogniser that somebody hands over can name what it likes, and nothing of it
runs. A path is named by

* :func:`register_classifier` or :func:`register_features` in a script,
* the options ``--classifier`` and ``--features`` of a command,
* the environment, ``FORCELAB_CLASSIFIERS`` and ``FORCELAB_FEATURES``, several with commas between,
* the preferences of the window,
* an installed package, by an entry point of the group ``forcelab.classifiers`` or
  ``forcelab.features``.

Settings that go from one process of ours to another by pickle, which no file is read by, take along
that their paths were named, so that workers resolve them as well.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from forcelab.errors import ForcelabError, InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Kind = Literal["classifier", "features"]
#: A path as settings hold it, its kind, and the function itself where no import finds it.
Named = tuple[Kind, str, Callable[..., Any] | None]

#: The group of entry points of each kind, the variable, and what a script calls.
GROUPS: dict[Kind, str] = {"classifier": "forcelab.classifiers", "features": "forcelab.features"}
VARIABLES: dict[Kind, str] = {"classifier": "FORCELAB_CLASSIFIERS", "features": "FORCELAB_FEATURES"}
_REGISTERING: dict[Kind, str] = {
    "classifier": "forcelab.register_classifier",
    "features": "forcelab.register_features",
}

#: What was named in this process; a function that was registered stands beside it.
_named: dict[Kind, dict[str, Callable[..., Any] | None]] = {"classifier": {}, "features": {}}
_imported: dict[str, Callable[..., Any]] = {}
#: What the window's preferences name, which can be taken back.
_preferred: dict[Kind, tuple[str, ...]] = {"classifier": (), "features": ()}


def is_import_path(name: object) -> bool:
    """Whether a name is ``module:function``; whether there is such a function is another matter."""
    return isinstance(name, str) and all(
        part and all(word.isidentifier() for word in part.split("."))
        for part in name.partition(":")[::2]
    )


def register_classifier(factory: Callable[[], Any]) -> str:
    """Let settings name a classifier of your own.

    Parameters
    ----------
    factory : callable
        A function or class of a module that, called without arguments, gives an unfitted classifier
        as scikit-learn's are: ``fit(X, y)``, ``predict``, ``classes_``, and ``predict_proba`` where
        a threshold or a decoder needs it. Its ``random_state``, if it has one that is None,
        becomes the seed of the settings.

    Returns
    -------
    str
        Its import path, for ``classifier`` of :class:`Settings`. Runs and recognisers keep it; to
        load such a recogniser elsewhere the path has to be named there too, as this function does.

    Raises
    ------
    InputError
        If it has no name at the top of a module.

    Examples
    --------
    >>> import forcelab
    >>> from sklearn.ensemble import RandomForestClassifier
    >>> name = forcelab.register_classifier(RandomForestClassifier)
    >>> forcelab.preset("fast").replace(classifier=name).classifier
    'sklearn.ensemble._forest:RandomForestClassifier'
    """
    return _register("classifier", factory)


def register_features(function: Callable[[NDArray[np.float64], float], Any]) -> str:
    """Let settings name features of your own.

    Parameters
    ----------
    function : callable
        A function of a module: ``function(signals, rate)`` gets the recognition channels of a
        demonstration on its uniform grid, an array of shape (n, q) in the channels' units without
        gaps, and the samples a second, and gives a row of features for each sample, shape (n, f).
        f must depend on q and the rate alone, and all numbers are finite.

    Returns
    -------
    str
        Its import path, for ``features`` of :class:`Settings`, alone or beside others. It is kept
        and has to be named again as that of :func:`register_classifier`.

    Raises
    ------
    InputError
        If it has no name at the top of a module.

    Examples
    --------
    >>> import forcelab
    >>> def energy(signals, rate):
    ...     return signals**2
    >>> name = forcelab.register_features(energy)
    >>> settings = forcelab.preset("best").replace(features=f"windows+{name}")
    """
    return _register("features", function)


def _register(kind: Kind, function: Callable[..., Any]) -> str:
    path = f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', '')}"
    if not is_import_path(path):
        raise InputError(
            f"{function!r} has no name at the top of a module, by which a recogniser could find it "
            f"again; define a function there and give that."
        )
    _named[kind][path] = function
    return path


def name_path(kind: Kind, path: str) -> str:
    """Take it that the user named a path, or an installed one by its name; the path."""
    found = next((known for known, label in installed(kind).items() if label == path), path)
    if is_import_path(found):
        _named[kind].setdefault(found, None)
        _find_here(found)
    return found


def prefer(kind: Kind, paths: Iterable[str]) -> None:
    """Take it that the user's preferences name these paths, and no longer what they did before."""
    _preferred[kind] = tuple(filter(is_import_path, paths))


def known_paths(kind: Kind) -> dict[str, str]:
    """What each path that may be imported is called: those of packages by their entry points."""
    named = (*filter(is_import_path, _environment(kind)), *_named[kind], *_preferred[kind])
    return installed(kind) | {path: path for path in named if path not in installed(kind)}


@cache
def installed(kind: Kind) -> dict[str, str]:
    """The paths that installed packages bring, with their names."""
    from importlib.metadata import entry_points  # takes its time to load

    found = entry_points(group=GROUPS[kind])
    return {f"{entry.module}:{entry.attr}": entry.name for entry in found}


def _environment(kind: Kind) -> list[str]:
    return [path.strip() for path in os.environ.get(VARIABLES[kind], "").split(",")]


def load_plugin(kind: Kind, path: str) -> Callable[..., Any]:
    """The function of a path that was named.

    Raises
    ------
    InputError
        If nobody named it here, and it was not imported then; or it cannot be imported.
    """
    if path not in known_paths(kind):
        verb, runs = ("is", "runs") if kind == "classifier" else ("are", "run")
        raise InputError(
            f"The {kind} '{path}' {verb} code from outside forcelab, which {runs} only where its "
            f"user names it: if you trust it, set {VARIABLES[kind]}={path}, name it in the "
            f"window's preferences, or call {_REGISTERING[kind]} in a script."
        )
    if (function := _named[kind].get(path) or _imported.get(path)) is not None:
        return function
    module, _, attributes = path.partition(":")
    cure = "install its package or add its folder to PYTHONPATH"
    with naming_plugin(path, "cannot be loaded", cure):
        if path in _environment(kind):
            _find_here(path)
        found: Any = import_module(module)
        for attribute in attributes.split("."):
            found = getattr(found, attribute)
        if not callable(found):
            raise TypeError("it is no function")
    _imported[path] = cast("Callable[..., Any]", found)
    return _imported[path]


def _find_here(path: str) -> None:
    """Let a package in the working folder be found, where there is no other of its name.

    A program that is installed does not look there; and what is named is often a file that one is
    writing. What the preferences name was named in another folder: in the one of a stranger's
    project a file of that name is the stranger's.
    """
    top, here = _package(path), str(Path.cwd())
    if top in sys.modules or here in sys.path or PathFinder.find_spec(top) is not None:
        return
    if PathFinder.find_spec(top, [here]) is not None:
        sys.path.append(here)


@contextmanager
def naming_plugin(path: str, failed: str, cure: str) -> Generator[None, None, None]:
    """Make a sentence of whatever somebody else's code raises."""
    try:
        yield
    except ForcelabError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        place = "" if isinstance(error, ImportError) else f"{type(error).__name__}: "
        raise InputError(f"'{path}' {failed} ({place}{reason}); {cure}.") from error


def is_own_type(name: str, path: str) -> bool:
    """Whether a type that a file names is a class of the package of a path.

    Never of scikit-learn, whose types skops knows. It has to be defined there: a class that is
    only imported there, such as one that starts programs, is not.
    """
    module, _, attribute = name.rpartition(".")
    if module.partition(".")[0] != _package(path) or _package(path) == "sklearn":
        return False
    value = getattr(sys.modules.get(module), attribute, None)
    return isinstance(value, type) and value.__module__ == module


def _package(path: str) -> str:
    return re.split("[.:]", path, maxsplit=1)[0]


def named_here(paths: Iterable[tuple[Kind, str]] | None = None) -> tuple[Named, ...]:
    """All that was named in this process, or those of some paths, for another process of ours.

    There :func:`name_as` takes it.
    """
    if paths is None:
        paths = [(kind, path) for kind in GROUPS for path in known_paths(kind)]
    named = [(kind, path) for kind, path in paths if path in known_paths(kind)]
    for kind, path in named:
        if path in _environment(kind):
            _find_here(path)  # what comes back from there may be of it
    return tuple(
        (kind, path, _named[kind].get(path) if path.startswith("__main__:") else None)
        for kind, path in named
    )


def name_as(named: Iterable[Named]) -> None:
    """Name what was named in the process that these come from."""
    for kind, path, function in named:
        if function is not None or path not in _named[kind]:
            _named[kind][path] = function


def distribution_versions(paths: Iterable[tuple[Kind, str]]) -> dict[str, str]:
    """The version of the package of each path, if it is one that is installed."""
    from importlib.metadata import PackageNotFoundError, version

    found = {}
    for _, path in paths:
        with suppress(PackageNotFoundError):  # a file of one's own, or called otherwise
            found[_package(path)] = version(_package(path))
    return found
