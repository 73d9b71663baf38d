"""The project: one folder, one SQLite store, and every edit ever made."""

from forcelab.project.records import (
    Added,
    Assignment,
    AssignmentEvent,
    Author,
    DemonstrationInfo,
    Edit,
    Incoming,
    LabelsUsed,
    Origin,
    StoredRecogniser,
    StoredRun,
    StoredVerdict,
    Verdict,
)
from forcelab.project.runs import RunSummary
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
    "Origin",
    "Project",
    "RunSummary",
    "StoredRecogniser",
    "StoredRun",
    "StoredVerdict",
    "Verdict",
]
