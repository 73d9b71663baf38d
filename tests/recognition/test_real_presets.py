"""How well a preset does on the paper's own recordings; bounds a little below what is reached."""

from __future__ import annotations

import pytest
from factories import read_labelled

from forcelab.jobs import finish
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.presets import preset


@pytest.mark.real
@pytest.mark.parametrize(
    ("file", "accuracy", "f1", "edit"),
    [("soft_sig.pdl", 0.955, 0.92, 0.7), ("JPen_sig.pdl", 0.81, 0.70, 0.7)],
)
def test_the_fast_preset_is_far_ahead_of_the_paper_on_the_papers_own_recordings(
    file, accuracy, f1, edit, real_file
):
    items = read_labelled(real_file(f"tongs/{file}"))
    pooled, _ = finish(leave_one_out_job(items, preset("fast"), folds=5)).scores("filtered")
    assert pooled.accuracy > accuracy
    assert pooled.f1_labelled["50"] > f1
    assert pooled.boundaries_found > 0.65
    assert pooled.edit > edit
    assert pooled.coverage == 1.0
