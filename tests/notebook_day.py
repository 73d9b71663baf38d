"""A day in a notebook, cell after cell, as a researcher writes it; mypy checks it strictly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from sklearn.model_selection import LeaveOneOut, cross_val_score
from sklearn.tree import DecisionTreeClassifier

import forcelab


def small_tree() -> DecisionTreeClassifier:
    """A classifier of one's own."""
    return DecisionTreeClassifier(max_depth=6)


def spend_a_day(folder: Path, csv: Path) -> dict[str, float]:
    """Import, look, label, cross-validate, compare and plot; gives what was found."""
    found: dict[str, float] = {}
    forcelab.import_files(folder, [csv], forcelab.ReadOptions(task="pull", author="Ada"))
    with forcelab.Project.open(folder) as project:
        # What is there, as tables.
        segments = forcelab.segments_frame(project, task="foam", author="Ada")
        seconds = np.asarray(segments["end"]) - np.asarray(segments["start"])
        found["seconds of hold"] = float(seconds[np.asarray(segments["action"]) == "hold"].sum())

        # A recording that was made in the notebook itself.
        columns = {"time": np.arange(300) / 100, "fx1 (N)": np.hanning(300)}
        bump = forcelab.Demonstration.from_frame(columns, "bump", task="pull")
        project.demonstrations.add(bump)
        editor = forcelab.TrackEditor(project, bump.id, "Ada")
        editor.paint(0.5, 2.5, "push")
        bump.plot(*project.tracks.of(bump.id)).save(folder / "bump.svg")

        # scikit-learn's cross-validation, of a classifier of one's own.
        labelled = forcelab.load_dataset(project, ["foam"], "Ada").labelled
        used = [item for item in labelled if item.segments]
        own = forcelab.register_classifier(small_tree)
        settings = forcelab.preset("paper").replace(classifier=own, max_scale=64, stride=5)
        scores = cross_val_score(
            forcelab.ForceActionClassifier(settings),
            [item.demonstration for item in used],
            [item.segments for item in used],
            cv=LeaveOneOut(),
        )
        found["mean accuracy"] = float(scores.mean())

        # The same as a run, which the window lists and reviews.
        selection = forcelab.DataSelection(tasks=("foam",), author="Ada")
        job = forcelab.evaluate_tasks_job(project, settings, selection)
        evaluation = forcelab.finish(job).evaluations[0][1]
        pooled, each = evaluation.scores("filtered")
        found["accuracy"] = pooled.accuracy or 0.0
        found["mean of each"] = float(np.mean([one.accuracy for one in each if one.accuracy]))
        runs = forcelab.runs_frame(project)
        run = forcelab.load_run(project, list(runs["run"])[-1])
        run.plot().save(str(folder / "pairs.svg"))
        table = forcelab.scores_frame(run)
        lower = np.asarray(table["row"]) == "lower"
        found["lower end"] = float(np.asarray(table["accuracy"])[lower][-1])
    return found
