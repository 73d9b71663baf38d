"""The project: one folder, one SQLite store, and every edit ever made."""

from forcelab.project.project import Project
from forcelab.project.records import (
    AddResult,
    Assignment,
    AssignmentEvent,
    Author,
    DemonstrationInfo,
    Edit,
    LabelImport,
    NewDemonstration,
    Note,
    Origin,
    StoredVerdict,
    Verdict,
    left_to_label,
)
from forcelab.project.runs import (
    LabelsUsed,
    Provenance,
    RunSummary,
    RunUse,
    StoredRecogniser,
    StoredRun,
)
from forcelab.project.tracks import UndoResult

__all__ = [
    "AddResult",
    "Assignment",
    "AssignmentEvent",
    "Author",
    "DemonstrationInfo",
    "Edit",
    "LabelImport",
    "LabelsUsed",
    "NewDemonstration",
    "Note",
    "Origin",
    "Project",
    "Provenance",
    "RunSummary",
    "RunUse",
    "StoredRecogniser",
    "StoredRun",
    "StoredVerdict",
    "UndoResult",
    "Verdict",
    "left_to_label",
]
