"""What a run keeps of an evaluation, as plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from forcelab.recognition.results import Evaluation

__all__ = ["digest", "kept", "title_of"]


def title_of(tasks: Sequence[str], test_task: str | None) -> str:
    """What an evaluation is called."""
    title = " + ".join(tasks) or "no task"
    return title if test_task is None else f"{title} → {test_task or 'no task'}"


def kept(evaluation: Evaluation, *, certainty: bool = False) -> dict[str, Any]:
    """An evaluation as a run keeps it, as plain values.

    Parameters
    ----------
    evaluation : Evaluation
    certainty : bool
        Whether it also keeps how certain each prediction is, and what each filter led to.
    """
    whole = evaluation.to_json()
    result = {"digest": digest(evaluation.title, whole)} | whole
    result["tracks"] = evaluation.tracks_to_json(stages=certainty)
    if certainty:
        result["certainty"] = {
            item.id: item.certainty.to_json()
            for item in evaluation.tested
            if item.certainty is not None
        }
    return result


def digest(title: str, whole: Mapping[str, Any]) -> dict[str, Any]:
    """What a list of runs says of one; rates from 0 to 1, None where there is none."""
    pooled = whole.get("filtered", {}).get("pooled", {})
    return {
        "title": title,
        "tested": len(whole.get("tested", ())),
        "accuracy": pooled.get("accuracy"),
        "edit": pooled.get("edit"),
        "f1": pooled.get("f1", {}).get("50"),
    }
