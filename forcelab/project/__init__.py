"""The project: one folder, one SQLite store, and every edit ever made."""

from forcelab.project.project import Project as Project
from forcelab.project.records import AddResult as AddResult
from forcelab.project.records import Assignment as Assignment
from forcelab.project.records import AssignmentEvent as AssignmentEvent
from forcelab.project.records import Author as Author
from forcelab.project.records import DemonstrationInfo as DemonstrationInfo
from forcelab.project.records import Edit as Edit
from forcelab.project.records import LabelImport as LabelImport
from forcelab.project.records import NewDemonstration as NewDemonstration
from forcelab.project.records import Note as Note
from forcelab.project.records import Origin as Origin
from forcelab.project.records import StoredVerdict as StoredVerdict
from forcelab.project.records import Verdict as Verdict
from forcelab.project.records import left_to_label as left_to_label
from forcelab.project.runs import LabelsUsed as LabelsUsed
from forcelab.project.runs import Provenance as Provenance
from forcelab.project.runs import RunSummary as RunSummary
from forcelab.project.runs import RunUse as RunUse
from forcelab.project.runs import StoredRecogniser as StoredRecogniser
from forcelab.project.runs import StoredRun as StoredRun
from forcelab.project.tracks import UndoResult as UndoResult
