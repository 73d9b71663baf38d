"""Settings in words: what a preset is, and what settings use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from forcelab.gui.review.settings_facts import Facts
from forcelab.gui.review.settings_fields import FIELDS

if TYPE_CHECKING:
    from forcelab.recognition.settings import Settings

__all__ = ["of_preset", "summary"]

_PRESETS = {
    "paper": "The published method, unchanged: to compare with what was published.",
    "released": (
        "What the authors' published code does where it differs from their text: slower movements "
        "and stronger filters."
    ),
    "fast": (
        "As best, but without peaks, trained on every fifth decision, contradicted or not, and not "
        "calibrated."
    ),
    "best": "The most accurate on the paper's recordings, with probabilities that can be believed.",
}


def of_preset(name: str) -> str:
    """What a preset is, in one sentence; empty for one that has none."""
    return _PRESETS.get(name, "")


def summary(settings: Settings, facts: Facts) -> str:
    """What settings use, a line each; what is not used is left out."""
    values = {field.name: getattr(settings, field.name) for field in FIELDS}
    lines = []
    for field in FIELDS:
        value = values[field.name]
        if not field.applies(values) or (value is None and field.name != "channels"):
            continue
        if field.name == "stride" and value == 1:
            continue  # all of them
        if field.name == "channels":
            shown = ", ".join(value or facts.channels) or "–"
        elif field.kind == "merge":
            shown = ", ".join(f"{source} → {target}" for source, target in value.items())
        elif field.kind == "choice":
            shown = dict(field.options)[value]
        elif field.kind == "flag":
            shown = "✓" if value else ""
        else:
            shown = f"{value:g} {field.unit if field.unit else ''}".strip()
        if shown:
            lines.append(f"{field.shown}: {shown}")
    return "\n".join(lines)
