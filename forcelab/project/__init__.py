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
    StoredRecogniser,
    StoredRun,
)
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
    "Project",
    "StoredRecogniser",
    "StoredRun",
]
