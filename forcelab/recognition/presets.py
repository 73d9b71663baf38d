"""The presets: named settings.

``paper`` is the published method, unchanged for ever; improvements are other presets, measured
against it.
"""

from __future__ import annotations

from collections.abc import Mapping

from forcelab.errors import InputError
from forcelab.recognition.settings import Settings
from forcelab.text import unknown_word

_BEST = Settings(
    preset="best",
    features="windows",
    step=0.02,
    amplitude="both",
    # Over demonstrations of real and simulated tasks more accurate, and nearer at boundaries.
    peaks=True,
    classifier="extra-trees",
    threshold=None,
    median=None,
    drop=None,
    calibrated=True,
    # Right labels lose nothing by it, and wrong ones half of what they cost. It would double the
    # fit time of `fast`.
    trimmed=True,
    changes=True,
    decoder="semi-markov",
)

#: All presets by name. ``paper`` is written out: no default that changes may ever change it.
PRESETS: Mapping[str, Settings] = {
    "paper": Settings(
        preset="paper",
        wavelet="morlet",
        parameter=5.0,
        min_scale=2.0,
        max_scale=1024.0,
        spacing=1.0,
        phase=True,
        classifier="mlp",
        stride=1,
        threshold=0.8,
        median=10,
        drop=1 / 8,
        seed=0,
    ),
    # What the authors' published code does where it differs from their text: it keeps the wide
    # scales, has no threshold, and takes a running median over 101 samples; then, as in the text,
    # runs shorter than a least length of each action go.
    "released": Settings(
        preset="released", min_scale=4.0, max_scale=4096.0, threshold=None, median=101, drop=1 / 8
    ),
    "fast": Settings(
        preset="fast",
        features="windows",
        step=0.02,
        amplitude="both",
        classifier="extra-trees",
        # A fraction of the fit time of `best`: neighbouring steps are almost copies.
        stride=5,
        threshold=None,
        median=None,
        drop=None,
        # What happens at a change of actions tells where it is better than what lies beside it.
        changes=True,
        decoder="semi-markov",
    ),
    "best": _BEST,
    # The paper's classifier on these features, and both of them averaged.
    "mlp": _BEST.replace(preset="mlp", classifier="mlp"),
    "ensemble": _BEST.replace(preset="ensemble", classifier="trees-mlp"),
}


def preset(name: str) -> Settings:
    """Look up a preset.

    Parameters
    ----------
    name : str
        One of :data:`PRESETS`: ``"paper"``, ``"released"``, ``"fast"``, ``"best"``, ``"mlp"`` or
        ``"ensemble"``.

    Returns
    -------
    Settings
        Its ``replace(stride=10)`` gives a copy in which that is another.

    Raises
    ------
    InputError
        If there is none of that name.

    Examples
    --------
    >>> forcelab.preset("paper").classifier
    'mlp'
    """
    if name not in PRESETS:
        raise InputError(unknown_word("preset", name, PRESETS))
    return PRESETS[name]
