"""The project: one folder, one SQLite store, and every edit ever made."""

from forcelab.project.clearing import RunUse
from forcelab.project.decisions import (
    Assignment,
    AssignmentEvent,
    Note,
    StoredVerdict,
    Verdict,
    left_to_label,
)
from forcelab.project.made import LabelsUsed, RunSummary, StoredRecogniser, StoredRun
from forcelab.project.records import (
    Added,
    Author,
    DemonstrationInfo,
    Edit,
    Incoming,
    Origin,
)
from forcelab.project.reverting import Reverted
from forcelab.project.store import Project

__all__ = [
    "Added",
    "Assignment",
    "AssignmentEvent",
    "Author",
    "DemonstrationInfo",
    "Edit",
    "Incoming",
    "LabelsUsed",
    "Note",
    "Origin",
    "Project",
    "Reverted",
    "RunSummary",
    "RunUse",
    "StoredRecogniser",
    "StoredRun",
    "StoredVerdict",
    "Verdict",
    "left_to_label",
]
