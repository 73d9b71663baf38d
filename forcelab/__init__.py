"""forcelab: label and recognise force actions.

``dir(forcelab)`` names what scripts need, ``help(forcelab.NAME)`` explains each; everything else is
found in the module that is named for it. They are loaded when they are first used.

Most scripts open a :class:`Project`, or :func:`read` a file. What has a name that ends in ``_job``
gives a generator of its progress; :func:`finish` runs it to the end and gives its result. All else
gives its result at once.

In the examples ``project`` is an open project, ``labelled`` what Ada labelled in it (from
:func:`load_dataset`), ``settings`` those of a quick recogniser and ``run`` the latest evaluation.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from forcelab.version import __version__

if TYPE_CHECKING:
    from forcelab.cluster import join_cluster as join_cluster
    from forcelab.demonstration import Channel as Channel
    from forcelab.demonstration import Demonstration as Demonstration
    from forcelab.errors import ForcelabError as ForcelabError
    from forcelab.errors import InputError as InputError
    from forcelab.formats import read as read
    from forcelab.formats.data_frame import read_frame as read_frame
    from forcelab.formats.importing import import_files as import_files
    from forcelab.formats.label_files import LabelOptions as LabelOptions
    from forcelab.formats.label_files import import_labels as import_labels
    from forcelab.formats.recording import ReadOptions as ReadOptions
    from forcelab.frames import runs_frame as runs_frame
    from forcelab.frames import samples_frame as samples_frame
    from forcelab.frames import scores_frame as scores_frame
    from forcelab.frames import segments_frame as segments_frame
    from forcelab.gui.figures.plots import plot as plot
    from forcelab.jobs import finish as finish
    from forcelab.label_map import MergeMap as MergeMap
    from forcelab.labels import Segment as Segment
    from forcelab.labels import Track as Track
    from forcelab.labels import from_codes as segments_from_codes
    from forcelab.project import Project as Project
    from forcelab.project.track_editor import TrackEditor as TrackEditor
    from forcelab.recognition.cross_validation import leave_one_out_job as leave_one_out_job
    from forcelab.recognition.cross_validation import train_and_test_job as train_and_test_job
    from forcelab.recognition.dataset import DataSelection as DataSelection
    from forcelab.recognition.dataset import load_dataset as load_dataset
    from forcelab.recognition.estimators import ForceActionClassifier as ForceActionClassifier
    from forcelab.recognition.estimators import ForceFeatures as ForceFeatures
    from forcelab.recognition.examples import Examples as Examples
    from forcelab.recognition.examples import LabelledDemonstration as LabelledDemonstration
    from forcelab.recognition.examples import prepare_examples as prepare_examples
    from forcelab.recognition.features import wavelet_features as wavelet_features
    from forcelab.recognition.metrics import Scores as Scores
    from forcelab.recognition.metrics import score_tracks as score_tracks
    from forcelab.recognition.plugins import register_classifier as register_classifier
    from forcelab.recognition.plugins import register_features as register_features
    from forcelab.recognition.presets import preset as preset
    from forcelab.recognition.project_runs import evaluate_tasks_job as evaluate_tasks_job
    from forcelab.recognition.project_runs import train_tasks_job as train_tasks_job
    from forcelab.recognition.recogniser import Recogniser as Recogniser
    from forcelab.recognition.results import Evaluation as Evaluation
    from forcelab.recognition.settings import Settings as Settings
    from forcelab.recognition.storage import load_recogniser as load_recogniser
    from forcelab.recognition.storage import save_recogniser as save_recogniser
    from forcelab.recognition.training import train as train
    from forcelab.review.agreement import agreement_job as agreement_job
    from forcelab.review.coder_tracks import coded_demonstrations as coded_demonstrations
    from forcelab.review.explanation import explain_at_job as explain_at_job
    from forcelab.review.queue import review_queue as review_queue
    from forcelab.review.run_comparison import compare_runs as compare_runs
    from forcelab.review.run_result import RunResult as RunResult
    from forcelab.review.run_result import latest_run as latest_run
    from forcelab.review.run_result import load_run as load_run
    from forcelab.sample import make_sample_job as make_sample_job
    from forcelab.signals.cwt import cwt as cwt
    from forcelab.signals.wavelets import DOG as DOG
    from forcelab.signals.wavelets import Haar as Haar
    from forcelab.signals.wavelets import Morlet as Morlet
    from forcelab.signals.wavelets import RealMorlet as RealMorlet
    from forcelab.simulation.generate import simulate_job as simulate_job
    from forcelab.simulation.tasks import perform_job as perform_job
    from forcelab.terms import glossary as glossary
    from forcelab.vocabulary import Vocabulary as Vocabulary

#: The public names of each module.
_NAMES = {
    "cluster": ("join_cluster",),
    "demonstration": ("Channel", "Demonstration"),
    "errors": ("ForcelabError", "InputError"),
    "formats": ("read",),
    "formats.data_frame": ("read_frame",),
    "formats.importing": ("import_files",),
    "formats.label_files": ("LabelOptions", "import_labels"),
    "formats.recording": ("ReadOptions",),
    "frames": ("runs_frame", "samples_frame", "scores_frame", "segments_frame"),
    "gui.figures.plots": ("plot",),
    "jobs": ("finish",),
    "label_map": ("MergeMap",),
    "labels": ("Segment", "Track", "segments_from_codes"),
    "project": ("Project",),
    "project.track_editor": ("TrackEditor",),
    "recognition.cross_validation": ("leave_one_out_job", "train_and_test_job"),
    "recognition.dataset": ("DataSelection", "load_dataset"),
    "recognition.estimators": ("ForceActionClassifier", "ForceFeatures"),
    "recognition.examples": ("Examples", "LabelledDemonstration", "prepare_examples"),
    "recognition.project_runs": ("evaluate_tasks_job", "train_tasks_job"),
    "recognition.features": ("wavelet_features",),
    "recognition.metrics": ("Scores", "score_tracks"),
    "recognition.plugins": ("register_classifier", "register_features"),
    "recognition.presets": ("preset",),
    "recognition.recogniser": ("Recogniser",),
    "recognition.results": ("Evaluation",),
    "recognition.settings": ("Settings",),
    "recognition.storage": ("load_recogniser", "save_recogniser"),
    "recognition.training": ("train",),
    "review.agreement": ("agreement_job",),
    "review.coder_tracks": ("coded_demonstrations",),
    "review.explanation": ("explain_at_job",),
    "review.queue": ("review_queue",),
    "review.run_comparison": ("compare_runs",),
    "review.run_result": ("RunResult", "latest_run", "load_run"),
    "sample": ("make_sample_job",),
    "signals.cwt": ("cwt",),
    "signals.wavelets": ("DOG", "Haar", "Morlet", "RealMorlet"),
    "simulation.generate": ("simulate_job",),
    "simulation.tasks": ("perform_job",),
    "terms": ("glossary",),
    "vocabulary": ("Vocabulary",),
}
#: What a name is called in its module, where that is another one.
_RENAMED = {"segments_from_codes": "from_codes"}
_HOMES = {name: module for module, names in _NAMES.items() for name in names}

__all__ = ["__version__", *sorted(_HOMES)]  # noqa: PLE0604 - all of them are strings


def __getattr__(name: str) -> Any:
    """Load a public name, so that importing forcelab itself loads nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'forcelab' has no attribute '{name}'")
    module = import_module(f"forcelab.{_HOMES[name]}")
    return getattr(module, _RENAMED.get(name, name))


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
