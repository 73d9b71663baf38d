"""Recognisers as files, without pickle.

A file is what skops writes: a zip of a JSON schema and plain arrays. Reading it builds no type but
the few named here, so that a file from a stranger can do no harm; those of a classifier's own
package only where the user of this program has named its import path, too
(:mod:`forcelab.recognition.plugins`). Classes of this package are written as plain values, so that
they may be renamed and moved; what older files hold is read as :data:`FORMATS` and the defaults of
:func:`_recogniser` say.
"""

from __future__ import annotations

import json
import tokenize
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import Any

from forcelab.errors import InputError
from forcelab.io import write_atomically
from forcelab.recognition.classifiers import (
    check_classifier,
    check_numbers,
    classifier_kind,
    prediction_state,
)
from forcelab.recognition.ensemble import CalibratedEnsemble
from forcelab.recognition.live_model import LiveModel
from forcelab.recognition.plugins import is_import_path, is_own_type, load_plugin
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.settings import PLAIN_CLASSIFIERS, RATES, Settings
from forcelab.recognition.task_grammar import BoundaryModel, TaskGrammar
from forcelab.resources import versions

#: Of what is written. Format 1 had of every node of a tree its children and all its values, in the
#: longest numbers: twelve times as much.
FORMAT = 2
#: What is read.
FORMATS = (1, 2)

#: Types beyond those skops trusts by itself that our classifiers consist of.
TRUSTED = (
    "sklearn.calibration._CalibratedClassifier",
    "sklearn.calibration._SigmoidCalibration",
    "sklearn.model_selection._split.StratifiedKFold",
)

#: What scikit-learn's classifiers hold besides, which one's own may: trees, whose nodes are
#: checked, and what has nothing but attributes.
OWN_TRUSTED = (
    "sklearn.tree._tree.Tree",
    "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
    "sklearn.neural_network._stochastic_optimizers.AdamOptimizer",
    "sklearn.neural_network._stochastic_optimizers.SGDOptimizer",
    "sklearn.utils._bunch.Bunch",
)

#: Samples of the grid in a window, and seconds of a shortest segment, that a file may ask for.
LONGEST_WINDOW, LONGEST_SEGMENT = 10_000_000, 1e6

#: What zipfile, skops, NumPy and scikit-learn raise over a file that is not what it seems.
DAMAGE = (
    ArithmeticError,
    AttributeError,
    EOFError,
    ImportError,
    LookupError,
    MemoryError,
    OSError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    tokenize.TokenError,
    zipfile.BadZipFile,
)


def dump(recogniser: Recogniser) -> bytes:
    """A recogniser as the bytes of its file; an InputError if it could not be loaded again."""
    classifier = recogniser.settings.classifier
    own = is_import_path(classifier)
    failures = (InputError, *DAMAGE) if own else (InputError,)
    try:
        content = pack(recogniser)
        _unpack(content, "it")
    except failures as error:
        if not own:
            raise InputError(
                f"The recogniser was not saved, as it could not be loaded again: {error}"
            ) from error
        cause = error.__cause__ or error
        # What follows says what to do about files of others.
        reason = str(cause).partition("; ")[0] or type(cause).__name__
        raise InputError(
            f"A recogniser with '{classifier}' cannot be kept in a file ({reason}); let the "
            f"classifier consist of plain values, arrays and objects of scikit-learn and of its "
            f"own package."
        ) from error
    return content


def pack(recogniser: Recogniser) -> bytes:
    """A recogniser as the bytes of its file, whatever it holds."""
    from skops import io

    grammar, boundary_model = recogniser.grammar, recogniser.boundary_model
    return bytes(
        io.dumps(
            {
                "forcelab recogniser": FORMAT,
                "settings": recogniser.settings.to_json(),
                "rate": recogniser.rate,
                "channels": list(recogniser.channels),
                "units": list(recogniser.units),
                "actions": list(recogniser.actions),
                "shortest": recogniser.shortest,
                "trained_on": list(recogniser.trained_on),
                "choreography": None if grammar is None else grammar.to_json(),
                "changes": None if boundary_model is None else boundary_model.plain(),
                "versions": versions(),
                "classifier": _prediction_state(recogniser.classifier, recogniser.settings),
                "live": [part.plain() for part in recogniser.live_models],
            }
        )
    )


def _prediction_state(classifier: Any, settings: Settings) -> Any:
    """The parts of a classifier that prediction needs."""
    if isinstance(classifier, CalibratedEnsemble):
        return classifier.plain()
    bare = prediction_state(settings.classifier, classifier)
    if hasattr(bare, "random_state") and not is_import_path(settings.classifier):
        bare.random_state = settings.seed
    return bare


def save_recogniser(recogniser: Recogniser, path: str | PathLike[str]) -> None:
    """Write a recogniser to a file, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written, or the recogniser could not be loaded again.

    Examples
    --------
    >>> forcelab.save_recogniser(forcelab.train(labelled, settings), "foam.skops")
    """
    write_atomically(Path(path), dump(recogniser))


def load_recogniser(path: str | PathLike[str]) -> Recogniser:
    """Read a recogniser from a file.

    Raises
    ------
    InputError
        If the file is none of ours, damaged, from a newer version, or holds a type that no
        recogniser needs; nothing of it has been run then.

    Examples
    --------
    >>> forcelab.save_recogniser(forcelab.train(labelled, settings), "foam.skops")
    >>> forcelab.load_recogniser("foam.skops").actions
    ('still', 'grab', 'hold', 'release')
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(
            f"There is no recogniser at {path}; check the name, or make one with 'forcelab train'."
        )
    try:
        content = path.read_bytes()
    except OSError as error:
        cure = "look who may read it"
        raise InputError(f"{path} cannot be read: {error.strerror}; {cure}.") from error
    return _unpack(content, str(path))


def _unpack(data: bytes, name: str) -> Recogniser:
    """The recogniser of a file's bytes; errors call it `name`."""
    from skops import io

    try:
        if not zipfile.is_zipfile(BytesIO(data)):
            raise InputError(f"{name} is not a recogniser; train one with 'forcelab train'.")
        with zipfile.ZipFile(BytesIO(data)) as archive:
            packed = any(part.compress_type != zipfile.ZIP_STORED for part in archive.infolist())
        if packed:
            # We never compress: nothing in a file can be larger than the file.
            raise zipfile.BadZipFile
        untrusted = sorted(set(io.get_untrusted_types(data=data)) - set(TRUSTED))
        own, called = _own_classifier(data) if untrusted else ("", set())
        if own:
            try:
                classifier_kind(own)
            except InputError as error:
                raise InputError(f"{name}: {error}") from error
        # Only what its own classifier consists of, and that only if its user named it.
        trusted = [
            t
            for t in untrusted
            if own and (t in OWN_TRUSTED or (t not in called and is_own_type(t, own)))
        ]
        if strange := sorted(set(untrusted) - set(trusted)):
            need = (
                f"which is neither a plain object of the package of '{own}' nor among the types of "
                f"scikit-learn that can be checked"
            )
            raise InputError(
                f"{name} holds the type {strange[0]}, "
                f"{need if own else 'which no recogniser needs'}; it was not loaded."
            )
        return _recogniser(io.loads(data, trusted=[*TRUSTED, *trusted]), name)
    except DAMAGE as error:
        raise InputError(
            f"{name} is not a whole recogniser ({type(error).__name__} while reading it); "
            f"train it again."
        ) from error


def _own_classifier(data: bytes) -> tuple[str, set[str]]:
    """The import path of the classifier that a file's settings name, empty if it is ours.

    And the types that are more than objects with attributes: those whose constructors would be
    called with what the file says, methods and functions. All is read as text, before any object is
    made.
    """
    with zipfile.ZipFile(BytesIO(data)) as archive:
        schema = json.loads(archive.read("schema.json"))
    own = ""
    with suppress(LookupError, TypeError, ValueError):  # it is no recogniser at all
        own = json.loads(schema["content"]["settings"]["content"]["classifier"]["content"])
    called, waiting = set[str](), [schema]
    while waiting:
        node = waiting.pop()
        if isinstance(node, list):
            waiting += node
        elif isinstance(node, dict):
            waiting += node.values()
            if node.get("__loader__") != "ObjectNode":
                called.add(f"{node.get('__module__')}.{node.get('__class__')}")
                # As the first format of skops, which it still reads, names a function.
                called.add(f"{node.get('module_path')}.{node.get('function')}")
    return own if is_import_path(own) else "", called


def _recogniser(content: object, name: str) -> Recogniser:
    """Check what was read and build the recogniser."""
    if not isinstance(content, Mapping) or "forcelab recogniser" not in content:
        raise InputError(f"{name} is not a recogniser; train one with 'forcelab train'.")
    if content["forcelab recogniser"] not in FORMATS:
        raise InputError(f"{name} comes from a newer forcelab; update forcelab to use it.")
    try:
        settings = Settings.from_json(content["settings"])
        for kind, path in settings.plugins:
            load_plugin(kind, path)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    own = ("classifier",) if is_import_path(settings.classifier) else ()  # which may be as it likes
    check_numbers({name: part for name, part in content.items() if name not in ("settings", *own)})
    classifier: Any = content["classifier"]
    recogniser = Recogniser(
        settings=settings,
        rate=float(content["rate"]),
        channels=_names(content["channels"]),
        actions=_names(content["actions"]),
        shortest={str(action): float(least) for action, least in content["shortest"].items()},
        classifier=classifier,
        trained_on=tuple(str(identity) for identity in content["trained_on"]),
        grammar=_choreography(content.get("choreography"), settings),
        live_models=_live(content),
        units=_units(content),
    )
    if not RATES[0] <= recogniser.rate <= RATES[1]:
        raise ValueError(f"a rate of {recogniser.rate} Hz")
    widths = [settings.windows, *(part.windows.windows for part in recogniser.live_models)]
    if max(map(max, widths)) * recogniser.rate > LONGEST_WINDOW:
        raise ValueError("windows of too many samples")
    if not all(0 <= least <= LONGEST_SEGMENT for least in recogniser.shortest.values()):
        raise ValueError("a shortest segment that lasts forever")
    try:
        width = settings.width(len(recogniser.channels), recogniser.rate)
    except InputError as error:  # of one's own features
        raise InputError(f"{name}: {error}") from error
    if (changes := content.get("changes")) is not None:  # older files have nothing of it
        recogniser = replace(recogniser, boundary_model=BoundaryModel.from_plain(changes, width))
    action_count = len(recogniser.actions)
    if recogniser.grammar is not None and recogniser.grammar.actions != recogniser.actions:
        raise ValueError("the choreography is of other actions")
    # Older files have a bare classifier where today's standardise.
    if settings.classifier in PLAIN_CLASSIFIERS or isinstance(classifier, Mapping):
        return replace(
            recogniser, classifier=CalibratedEnsemble.from_plain(classifier, width, action_count)
        )
    check_classifier(
        classifier, settings.classifier, settings.needs_probabilities, width, action_count
    )
    return recogniser


def _choreography(plain: object, settings: Settings) -> TaskGrammar | None:
    """Check what the decoder knows; older files have no decoder and nothing of it."""
    if not settings.decodes:
        return None
    if not isinstance(plain, Mapping):
        raise TypeError("no choreography")
    return TaskGrammar.from_json(plain)


def _live(content: Mapping[str, Any]) -> tuple[LiveModel, ...]:
    """Check what follows streams; older files have nothing of it."""
    channels, actions = len(content["channels"]), len(content["actions"])
    parts = content.get("live", [])
    if not isinstance(parts, list):
        raise TypeError("no list of parts")
    return tuple(LiveModel.from_plain(part, channels, actions) for part in parts)


def _units(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Check the channels' units; older files have none."""
    units = content.get("units", [])
    if not isinstance(units, list) or not all(isinstance(unit, str) for unit in units):
        raise TypeError("no list of units")
    if units and len(units) != len(content["channels"]):
        raise ValueError("not a unit for each channel")
    return tuple(units)


def _names(values: object) -> tuple[str, ...]:
    """Check a list of distinct names."""
    if not isinstance(values, list) or not all(isinstance(name, str) and name for name in values):
        raise TypeError("no list of names")
    if len(set(values)) < len(values):
        raise ValueError("a name occurs twice")
    return tuple(values)
