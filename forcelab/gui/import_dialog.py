"""The dialog that imports recordings into the open project, and the columns a table is read as."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable, Collection, Generator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from threading import Event
from typing import Final, NamedTuple

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QComboBox,
    QDialog,
    QDoubleSpinBox,
    QFormLayout,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QScrollArea,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.formats import identify, preview
from forcelab.formats.importing import ImportReport, importing, is_video, pair_videos
from forcelab.formats.lerobot_dataset import stated_episodes
from forcelab.formats.recording import ANY_USE, ColumnUse, ReadOptions, Use, parse_episodes
from forcelab.formats.signatures import Format, is_lerobot_folder, lerobot_folder
from forcelab.formats.table import rate_in
from forcelab.formats.table_sniff import is_time_name
from forcelab.gui import settings
from forcelab.gui.author_choice import UnsignedCoder
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.file_dialogs import (
    FileDrop,
    ask_file,
    ask_files,
    ask_folder,
    let_remove,
    vacant_path,
    with_suffix,
)
from forcelab.gui.jobs import Jobs
from forcelab.gui.key_events import ignore_wheel
from forcelab.gui.layout import (
    ProgressRow,
    add_buttons,
    copyable,
    fill_layout,
    push_button,
    resize_on_screen,
    sentence_label,
    set_enabled_with_reason,
    toned_label,
)
from forcelab.gui.text import name_fields, settle_name
from forcelab.gui.theme import colours
from forcelab.gui.widgets import show_text
from forcelab.jobs import Progress
from forcelab.signals.channels import find_force_axes
from forcelab.text import counted, listed, tidy_name

#: Options of the command, and what is chosen here in their place.
_FIELDS: Final = {
    "--signal": "Read as: signal",
    "--leave-out": "Read as: left out",
    "--time": "Read as: times",
    "--label": "Read as: labels",
    "--rate": "Sample rate",
    "--jitter": "Timestamps may jitter by",
    "--episodes": "Episodes of a dataset",
}
#: What is in the columns of the dialog's table.
_NAME, _SIZE, _CELLS, _USE, _UNIT = range(5)
#: Free room above and below a choice, in pixels.
CELL_PADDING = 3
#: Columns that are shown at most: each has a list to choose from, which takes its time.
MOST_SHOWN = 1000
#: How many signals are named at most that are no axes of a force sensor.
OTHERS_NAMED = 4
#: What one column at most is read as; a counter stands in for times.
_EXCLUSIVE: Final = ("times", "counter"), ("labels",)
#: How many kinds of files are remembered with what was chosen for them.
_REMEMBERED = 100
#: The key of the job that previews a file, and the milliseconds after which that is said.
PREVIEW_JOB = "import columns"
_PREVIEW_MS = 300
#: Formats whose columns become channels under their names.
_TABLES = "table", "excel", "parquet"


@dataclass(frozen=True, slots=True)
class _ColumnPreview:
    """What a file's columns are found to be, and read as with choices; or why they are not."""

    path: Path | None = None
    found: tuple[ColumnUse, ...] = ()
    uses: tuple[ColumnUse, ...] = ()
    trouble: str = ""
    rate: float | None = None  #: samples a second that a table's head tells
    table: bool = False  #: whether a channel is called as its column is


def _previewing(
    path: Path, chosen: ReadOptions | None, known: _ColumnPreview | None
) -> Generator[None, None, _ColumnPreview]:
    """Preview a file's columns as the importer reads them; of some formats that takes its time.

    What is found without choices need not be looked for again where it is `known`.
    """
    yield
    result = known or _ColumnPreview(path)
    try:
        if known is None:
            format_ = identify(path).name
            rate = rate_in(path) if format_ == "table" else None
            found = preview(path, ReadOptions())
            result = _ColumnPreview(path, found, rate=rate, table=format_ in _TABLES)
        uses = result.found
        if chosen is not None and uses:
            yield
            uses = preview(path, chosen)
        return replace(result, uses=uses, trouble="")
    except (InputError, OSError) as error:
        return replace(result, uses=result.found, trouble=str(error))


class ImportColumns(QWidget):
    """What each column of a table, or array in a file, is read as; shown for one file.

    That is the first file at first. `table` has a row for each column: its name, its first cells,
    the choice, and the size of an array; arrays stand below the group that they are in. `rate` is
    that of files without times. What was chosen for a file is proposed for the next one that has
    the same columns.
    """

    #: The columns are shown as they are read now.
    previewed = Signal()

    def __init__(self, jobs: Jobs) -> None:
        super().__init__()
        self._jobs = jobs
        self._path: Path | None = None
        self._chosen: dict[str, Use] = {}
        self._units: dict[str, str] = {}
        self._preview = _ColumnPreview()
        self._first = self._proposed = False
        self._waiting = QTimer(self, singleShot=True, interval=_PREVIEW_MS)
        self._waiting.timeout.connect(self._announce_preview)
        self.rate = QDoubleSpinBox(maximum=1e6, suffix=" Hz")
        self.rate.setSpecialValueText("from the time column")
        self.rate.setAccessibleName("Sample rate of files without times")
        self.rate.valueChanged.connect(self._show_status)
        self.heading = sentence_label()
        self.others = toned_label("warning")
        self.others.hide()
        self.table = QTableWidget(0, 5)
        self.table.setAccessibleName("Columns of the table")
        self.table.setHorizontalHeaderLabels(["Column", "Size", "First cells", "Read as", "Unit"])
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(_CELLS, QHeaderView.ResizeMode.Stretch)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        header.setHighlightSections(False)
        self.table.verticalHeader().hide()
        self.table.setShowGrid(False)
        self.table.setWordWrap(False)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        high = QComboBox().sizeHint().height() + 2 * CELL_PADDING
        self.table.verticalHeader().setDefaultSectionSize(high)
        fill_layout(QVBoxLayout(self), self.heading, self.others, (self.table, 1), margins=0)
        self.setVisible(False)

    def show_first(self, files: Sequence[Path]) -> None:
        """Show the columns of the first file that has any."""
        if self._path in files:
            return
        self._path = next((file for file in files if _format_of(file).columns), None)
        self._chosen.clear()
        self._units.clear()
        self._first, self._proposed = True, False
        self._fill()

    def show_file(self, path: Path) -> None:
        """Show the columns of another file, if it has any; choices hold for all files."""
        if path != self._path and _format_of(path).columns:
            self._path = path
            self._fill()

    def options(self) -> ReadOptions:
        """The choices; what was not chosen is found in each file."""
        names = {use: name for name, use in self._chosen.items()}
        return ReadOptions(
            time=names.get("times"),
            counter=names.get("counter"),
            label=names.get("labels"),
            leave_out=tuple(name for name, use in self._chosen.items() if use == "left out"),
            signals=tuple(name for name, use in self._chosen.items() if use == "signal"),
            units=tuple(self._chosen_units.items()),
        )

    def choose(self, name: str, use: Use) -> None:
        """Read a column as something else."""
        replaced = next((uses for uses in _EXCLUSIVE if use in uses), ())
        self._chosen = {n: u for n, u in self._chosen.items() if n != name and u not in replaced}
        found = {column.name: column.use for column in self._preview.found}
        if found.get(name) != use:
            self._chosen[name] = use
        self._fill()

    @property
    def _chosen_units(self) -> dict[str, str]:
        """The units that were given, but for columns that become no channel."""
        others = {column.name for column in self.uses if column.use not in ("signal", "counter")}
        return {name: unit for name, unit in self._units.items() if name not in others}

    def set_unit(self, name: str, unit: str) -> None:
        """Give a column that is a signal a unit, which its file does not state; "" for none."""
        self._units.pop(name, None)
        if unit.strip():
            self._units[name] = tidy_name(unit)

    @property
    def uses(self) -> tuple[ColumnUse, ...]:
        """What each column is read as; while the file cannot be read so, what was chosen."""
        uses, chosen = self._preview.uses, self._chosen
        if not self._preview.trouble or not chosen:
            return uses
        # There is one of each of these: what was found gives way to what was chosen.
        taken = set(chosen.values()) & {"times", "counter", "labels"}
        return tuple(
            replace(c, use=chosen.get(c.name, "left out" if c.use in taken else c.use))
            for c in uses
        )

    @property
    def previewing(self) -> bool:
        """Whether a file is being looked at."""
        return self._jobs.awaits(PREVIEW_JOB)

    def _fill(self) -> None:
        """Show the columns as they are read now, once the file has been looked at."""
        if self._path is None:
            self._jobs.cancel(PREVIEW_JOB)
            self._show(_ColumnPreview())
            return
        chosen = self.options() if self._chosen else None
        same = self._preview.path == self._path and self._preview.found
        known = self._preview if same else None
        self._waiting.start()
        self._jobs.run(_previewing(self._path, chosen, known), self._show, key=PREVIEW_JOB)

    def _announce_preview(self) -> None:
        if self.previewing and self._path is not None:
            self.heading.setText(f"Looking at {self._path.name}…")
            self.heading.setStyleSheet("")
            self.setVisible(True)

    def _show(self, shown: _ColumnPreview) -> None:
        self._waiting.stop()
        self._preview = shown
        choices = _remembered_choices() if self._first else []
        self._first = False
        for choice in choices:
            if choice.schema == self._schema:
                self._proposed, self._chosen, self._units = True, choice.uses, choice.units
                self._fill()
                self.rate.setValue(choice.rate)
                return
        self.setVisible(bool(shown.uses))
        self._fill_table()
        self._show_status()
        self.previewed.emit()

    def _fill_table(self) -> None:
        """Make a row for each column, and one above those of a group of arrays."""
        arrays = any(column.size for column in self.uses)
        self.table.setColumnHidden(_SIZE, not arrays)
        signals = (column for column in self.uses if column.use == "signal")
        unit_missing = [c.name for c in signals if self._preview.table and not c.unit]
        self.table.setColumnHidden(_UNIT, not unit_missing)
        self.table.setHorizontalHeaderItem(_NAME, QTableWidgetItem("Array" if arrays else "Column"))
        groups: dict[str, list[ColumnUse]] = {"": []}
        shown = self.uses[:MOST_SHOWN]
        for column in shown:
            groups.setdefault(_group(column), []).append(column)
        self.table.clearSpans()
        self.table.setRowCount(len(shown) + len(groups) - 1)
        row = 0
        for group, columns in groups.items():
            if group:
                self._fill_row(row, (group.rstrip("/."), "", "", ""), bold=True)
                self.table.removeCellWidget(row, _USE)
                self.table.setSpan(row, _NAME, 1, 5)
                row += 1
            for column in columns:
                name = column.name.removeprefix(group)
                name = f"{name} [{column.unit}]" if column.unit else name
                texts = ("      " * bool(group) + name, column.size, "   ".join(column.cells), "")
                self._fill_row(row, texts)
                self.table.setCellWidget(row, _USE, _padded(self._choice(column)))
                if column.name in unit_missing:
                    self.table.setCellWidget(row, _UNIT, _padded(self._unit_line(column.name)))
                else:
                    self.table.removeCellWidget(row, _UNIT)
                row += 1

    def _fill_row(self, row: int, texts: Sequence[str], bold: bool = False) -> None:
        font = self.table.font()
        font.setBold(bold)
        for place, text in enumerate(texts):
            item = QTableWidgetItem(text)
            item.setToolTip(text.strip())
            item.setFont(font)
            self.table.setItem(row, place, item)

    @property
    def _schema(self) -> str:
        """What files have in common whose columns have the same names and numbers of axes."""
        columns = sorted((column.name, column.size.count("×")) for column in self._preview.found)
        return hashlib.sha256(json.dumps(columns).encode()).hexdigest()[:16] if columns else ""

    def choice(self) -> FileChoice:
        """What is chosen for files of this schema, to be remembered once they are imported."""
        timed = any(column.use == "times" for column in self.uses)
        rate = 0.0 if timed else self.rate.value()
        return FileChoice(self._schema, dict(self._chosen), rate, self._chosen_units)

    def _show_status(self) -> None:
        """Say which file is shown, and what is missing."""
        trouble = name_fields(self._preview.trouble, _FIELDS)
        self.heading.setText(trouble or self._file_sentence())
        wrong = trouble or not self._timed or not self._has_signals
        self.heading.setStyleSheet(f"color: {colours().warning}" if wrong else "")
        show_text(self.others, self._others_sentence())

    def _others_sentence(self) -> str:
        """Which signals are beside the axes of force sensors; "" without such axes."""
        signals = [column.name for column in self.uses if column.use == "signal"]
        axes = find_force_axes(signals)
        others = [name for name in signals if name not in axes]
        if not axes or not others:
            return ""
        if len(others) == 1:
            return (
                f"{others[0]} is no force axis and will be read as a signal too; leave it out if "
                "it says nothing about the action."
            )
        return (
            f"{len(others)} columns are no force axes ({listed(others, OTHERS_NAMED)}) and will be "
            "read as signals too; leave out what says nothing about the action."
        )

    @property
    def _has_signals(self) -> bool:
        """Whether anything becomes a channel, or cannot before the table is read as a whole."""
        uses = {column.use for column in self.uses}
        return not uses or bool(uses & {"signal", "counter"})

    @property
    def _timed(self) -> bool:
        """Whether the times of the samples are known."""
        rate = self.rate.value() or self._preview.rate
        return bool(rate) or any(column.use == "times" for column in self.uses)

    def _file_sentence(self) -> str:
        """Which file this is and how its times are known."""
        name = self._path.name if self._path else ""
        if len(self.uses) > MOST_SHOWN:
            name += f" (the first {MOST_SHOWN:,} of {len(self.uses):,})"
        kinds = [column.use for column in self.uses]
        if not self._has_signals:
            return f"It is not plain which are the signals in {name}; choose them:"
        if self._timed and self._proposed and (self._chosen or self._units):
            return f"Columns of {name}, read as was chosen for such a file before:"
        if self._timed:
            return f"Columns of {name}, and what each is read as:"
        if "counter" in kinds:
            return f"{name} has no times but counts its samples; give their rate:"
        if stuck := self._stuck():
            return (
                f"In {name} the times in '{stuck}' never change; choose another column, or give "
                "the sample rate:"
            )
        return f"{name} has no column of times; choose one, or give the sample rate:"

    def _stuck(self) -> str:
        """The time column that the importer leaves out as it never changes; "" without one."""
        found = self._preview.found
        if any(column.use == "times" for column in found):
            return ""
        stuck = (c for c in found if c.use == "left out" and is_time_name(c.name) and any(c.cells))
        return next((column.name for column in stuck), "")

    def _unit_line(self, name: str) -> QLineEdit:
        line = QLineEdit(self._units.get(name, ""), placeholderText="none", maxLength=20)
        line.setFixedWidth(9 * line.fontMetrics().averageCharWidth())
        line.setObjectName("field")  # it has a frame, as fields outside of tables have
        line.setAccessibleName(f"Unit of {name}")
        line.setToolTip("The file states no unit; enter one, such as N or Nm")
        line.textChanged.connect(partial(self.set_unit, name))
        return line

    def _choice(self, column: ColumnUse) -> QComboBox:
        box = QComboBox()
        ignore_wheel(box)  # it scrolls the table
        box.setAccessibleName(f"{column.name} is read as")
        found = [other.use for other in self._preview.found if other.name == column.name]
        for use in dict.fromkeys((*found, column.use, *column.choices)):
            box.addItem("sample counter" if use == "counter" else use, use)
        box.setCurrentIndex(box.findData(column.use))
        box.activated.connect(lambda index: self.choose(column.name, box.itemData(index)))
        return box


def _padded(choice: QWidget) -> QWidget:
    """A choice that does not touch those above and below it."""
    cell = QWidget()
    margins = 0, CELL_PADDING, 2 * CELL_PADDING, CELL_PADDING
    fill_layout(QHBoxLayout(cell), choice, margins=margins)
    return cell


class FileChoice(NamedTuple):
    """What was chosen for files of a schema."""

    schema: str
    uses: dict[str, Use]
    rate: float
    units: dict[str, str]


def _remembered_choices() -> list[FileChoice]:
    """What was chosen for files of each schema, the latest first."""
    choices = []
    for text in settings.strings("import/choices"):
        with suppress(ValueError, TypeError, AttributeError):
            schema, uses, rate, *units = json.loads(text)
            known = {str(n): use for n, use in uses.items() if use in ANY_USE}
            named = {str(n): str(unit) for n, unit in (units[0] if units else {}).items()}
            choices.append(FileChoice(str(schema), known, min(max(float(rate), 0.0), 1e6), named))
    return choices


def _remember(choice: FileChoice) -> None:
    """Remember what was chosen for files of a schema; what is found by itself is no choice."""
    others = [other for other in _remembered_choices() if other.schema != choice.schema]
    latest = [choice] if choice.schema and any(choice[1:]) else []
    settings.store("import/choices", [*map(json.dumps, [*latest, *others][:_REMEMBERED])])


def _group(column: ColumnUse) -> str:
    """The group that an array is in, with its separator; empty for what is in none."""
    bare = re.sub(r" \d+$", "", column.name)
    return column.name[: max(bare.rfind("/"), bare.rfind(".")) + 1] if column.size else ""


def _format_of(path: Path) -> Format:
    """A file's format, which is none of the known ones where it cannot be told."""
    try:
        return identify(path)
    except (InputError, OSError):
        return Format("", "", "")  # what is wrong is told when the file is read


def _loose_videos(files: Sequence[Path]) -> list[Path]:
    """The videos among recordings that belong to none of them by name."""
    unpaired, _ = pair_videos(files)
    loose = [*filter(is_video, unpaired)]
    return loose if len(loose) < len(unpaired) else []


def _optional_line(name: str, placeholder: str) -> QLineEdit:
    """A line that may stay empty, which then means what it says."""
    line = QLineEdit(clearButtonEnabled=True, placeholderText=placeholder)
    line.setAccessibleName(name)
    return line


def _run_until(
    cancelled: Event, steps: Generator[Progress, None, ImportReport]
) -> Generator[Progress, None, ImportReport | None]:
    """Run an import; None where it was cancelled before it was done, and left nothing."""
    with closing(steps):
        try:
            while not cancelled.is_set():
                yield next(steps)
        except StopIteration as end:
            report: ImportReport = end.value
            return report
    return None


def _count_line(report: ImportReport) -> str:
    """How many demonstrations were imported."""
    new, *others = [report.count(status) for status in ("new", "updated", "unchanged")]
    if new and not any(others):
        return f"{counted(new, 'demonstration')} imported."
    return "{} new, {} updated, {} unchanged.".format(new, *others)


class ImportDialog(FileDrop, QDialog):
    """Choose files, their task and the coder of their labels; import them, and report.

    `files` are chosen already, such as by dropping them on the window. While no project is open
    they go into a new one beside them, which `open_project` opens then.
    """

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        parent: QWidget | None = None,
        files: Sequence[Path] = (),
        open_project: Callable[[Path], bool] | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Import demonstrations")
        resize_on_screen(self, QSize(680, 760))
        self._document, self._jobs, self._open_project = document, jobs, open_project
        self._tasks_named = self._closed = False
        self._cancelled = Event()
        self._files = QListWidget()
        self._files.setAccessibleName("Files to import")
        # The end of a path tells files apart.
        self._files.setTextElideMode(NAMES)
        self._files.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._files.setSelectionMode(QListWidget.SelectionMode.ExtendedSelection)
        let_remove(self._files, self._remove)
        self.setAcceptDrops(True)
        self.columns = ImportColumns(jobs)
        self.columns.previewed.connect(self._import_when_previewed)
        self._import_asked = False
        self._files.currentTextChanged.connect(self._show_columns)
        self._running = ProgressRow("the import", self._cancel)
        column = fill_layout(
            QVBoxLayout(self), self._heading(), (self._files, 1), (self.columns, 3), self._form()
        )
        fill_layout(column, self._taskless, self._running, (self._result(), 3))
        self._go, self._close = add_buttons(self, "Import", self._import)
        self._propose_project(files)
        self.add_files(files)
        # Enter asks for files, and imports once they are there.
        (self._task if files else self._pick).setFocus()

    def _heading(self) -> QHBoxLayout:
        """What can be imported, and the button that chooses files."""
        self._pick = push_button("Choose files…", self._choose)
        kinds = (
            "Recordings, chosen or dropped here: tables (CSV, TSV, Parquet, Excel), arrays (NumPy, "
            "MATLAB, HDF5), ROS bags, LeRobot datasets (the folder, or its meta/info.json), XDF, "
            "C3D, TDMS, raw OptoForce dumps, *.pdl, archives of projects"
        )
        return fill_layout(QHBoxLayout(), (sentence_label(kinds), 1), self._pick)

    def _form(self) -> QFormLayout:
        """What the files do not say themselves."""
        document = self._document
        self.open_project_name = sentence_label()
        self._task = QComboBox(editable=True)
        self._task.setAccessibleName("Task")
        self._task.addItems(document.project.demonstrations.tasks() if document.project else ())
        # Of no task until one is chosen: the last one is seldom what is done in the next files.
        self._task.setCurrentText("")
        self._task.currentTextChanged.connect(self._warn)
        self._author = UnsignedCoder(document, ReadOptions().author)
        self.jitter = QDoubleSpinBox(maximum=1e6, decimals=3, suffix=" ms")
        self.jitter.setSpecialValueText("none")
        self.jitter.setAccessibleName("Timestamps may jitter by")
        self.calibration = _optional_line(
            "Calibration file of raw OptoForce dumps", "none: forces stay in counts"
        )
        choose = push_button("Choose…", self._ask_calibration, "Choose the calibration file")
        calibration = fill_layout(QHBoxLayout(), (self.calibration, 1), choose)
        self.episodes = _optional_line("Episodes of a dataset", "")
        self.videos = QCheckBox("Attach videos beside them that have the same name")
        self.videos.setChecked(True)
        self._taskless = toned_label(
            "warning",
            ("Enter the task shown in these files, for example stylus. Import one task at a time."),
        )
        keeping = self._taskless.sizePolicy()  # so that nothing moves while a task is typed
        keeping.setRetainSizeWhenHidden(True)
        self._taskless.setSizePolicy(keeping)
        self._layout = form = QFormLayout()
        form.addRow("New project", self._new_project_row())
        form.addRow("Project", self.open_project_name)
        form.addRow("Episodes of a dataset", self.episodes)
        form.addRow("Task", self._task)
        form.addRow("Coder for unsigned labels", self._author)
        form.addRow("Sample rate, where files have no times", self.columns.rate)
        form.addRow("Timestamps may jitter by", self.jitter)
        form.addRow("Calibration of raw OptoForce dumps", calibration)
        form.addRow("", self.videos)
        return form

    def _new_project_row(self) -> QHBoxLayout:
        """Name and place of the project that is made while none is open."""
        self.project_name, self.project_folder = QLineEdit(), QLineEdit()
        self.project_name.setAccessibleName("Name of the new project")
        letter = self.project_name.fontMetrics().averageCharWidth()
        self.project_name.setMinimumWidth(26 * letter)
        self.project_folder.setAccessibleName("Folder in which the new project is made")
        name = "Choose the folder of the new project"
        choose = push_button("Choose…", self._ask_project_folder, name)
        parts = (self.project_name, 2), QLabel("in"), (self.project_folder, 3), choose
        return fill_layout(QHBoxLayout(), *parts)

    def _propose_project(self, files: Sequence[Path]) -> None:
        """Propose a new project beside the recordings, where there is none to import into."""
        project = self._document.project
        self._layout.setRowVisible(0, project is None)
        self._layout.setRowVisible(self.open_project_name, project is not None)
        if project is not None:
            name = f"{project.path.name} (File > New project… begins another)"
            self.open_project_name.setText(name)
            self.open_project_name.setToolTip(str(project.path))
            return
        if not files:
            return
        recordings = files[0].absolute().parent
        folder = recordings if os.access(recordings, os.W_OK) else settings.documents_folder()
        # An archive names a project.
        archive = len(files) == 1 and _format_of(files[0]).name == "archive"
        name = files[0].stem if archive else recordings.name
        self.project_name.setText(vacant_path(folder, name or "study").name)
        self.project_name.setCursorPosition(0)  # its beginning tells it from others
        self.project_folder.setText(str(folder))

    def _ask_project_folder(self) -> None:
        folder = ask_folder(self, "Folder of the new project", "project")
        if folder is not None:
            self.project_folder.setText(str(folder))

    def _project_path(self) -> Path:
        """The project that is open, or the one to make."""
        if (project := self._document.project) is not None:
            return project.path
        name = self.project_name.text().strip() or "study"
        return with_suffix(Path(self.project_folder.text().strip()).expanduser() / name)

    def _result(self) -> QScrollArea:
        page = QWidget()
        self._report_labels = [copyable() for _ in range(3)]
        self._report_labels[1].setProperty("tone", "trouble")
        fill_layout(QVBoxLayout(page), *self._report_labels, 1, margins=4, spacing=4)
        self._report = QScrollArea(widgetResizable=True)
        self._report.setWidget(page)
        self._report.setVisible(False)
        return self._report

    def add_files(self, files: Sequence[Path]) -> None:
        listed = self._listed()
        for path in files:
            folder = lerobot_folder(path)
            name = str(folder if is_lerobot_folder(folder) else path)
            if Path(name) not in listed:
                QListWidgetItem(name, self._files).setToolTip(name)
        self._changed()

    def reject(self) -> None:
        """Close, and cancel a running import; one that is written by then is shown nevertheless."""
        self._jobs.cancel(PREVIEW_JOB)
        self._cancelled.set()
        self._closed = True
        super().reject()

    def _warn(self) -> None:
        """Warn of recordings without a task, which are allowed, unless the files name theirs."""
        missing = not self._task.currentText().strip() and not self._tasks_named
        self._taskless.setVisible(missing and self._files.count() > 0)
        self._go.setText("Import without a task" if missing else "Import")

    def _choose(self) -> None:
        chosen = ask_files(self, "Recordings", "recordings")
        self.add_files(chosen)
        if chosen:  # what is typed next is the task, unless it is known; Enter imports
            (self._task if self._taskless.isVisibleTo(self) else self._go).setFocus()
            self._go.setDefault(True)

    def _ask_calibration(self) -> None:
        file = ask_file(self, "Calibration file", "calibration", "Calibration files (*.toml)")
        if file is not None:
            self.calibration.setText(str(file))

    def _remove(self) -> None:
        for item in self._files.selectedItems():
            self._files.takeItem(self._files.row(item))
        self._changed()

    def _show_columns(self, name: str) -> None:
        """Show the columns of the selected file."""
        if name:
            self.columns.show_file(Path(name))

    def _listed(self) -> list[Path]:
        """The files in the list."""
        return [Path(self._files.item(row).text()) for row in range(self._files.count())]

    def _changed(self) -> None:
        """Follow a change of the list of files."""
        files = self._listed()
        reason = "" if files else "Add files first."
        set_enabled_with_reason(
            self._go, reason if self._running.isHidden() else "Wait until this is imported."
        )
        self._show_report()  # it was of files that were in the list before
        datasets = [*filter(is_lerobot_folder, files)]
        self._tasks_named = bool(files) and all(
            path in datasets or _format_of(path).name == "archive" for path in files
        )
        self._layout.setRowVisible(self.episodes, bool(datasets))
        count = stated_episodes(datasets[0]) if len(datasets) == 1 else ""
        self.episodes.setPlaceholderText(" ".join(f"all {count}".split()) + ", or such as 0-9, 12")
        task = self._task.lineEdit()
        if task is not None:
            source = "dataset" if datasets else "archive"
            task.setPlaceholderText(f"as the {source} says" if self._tasks_named else "")
        self._warn()
        self.columns.show_first(files)

    def _import_when_previewed(self) -> None:
        if self._import_asked:
            self._import()

    def _import(self) -> None:
        """Import in the background, once it is known what the columns are read as."""
        self._import_asked = self.columns.previewing
        if self._import_asked:
            return
        path, project = self._project_path(), self._document.project
        tasks = () if project is None else project.demonstrations.tasks()
        calibration = self.calibration.text().strip()
        try:
            episodes = parse_episodes(self.episodes.text())
        except InputError as error:
            self._failed(error)
            return
        options = replace(
            self.columns.options(),
            episodes=episodes,
            task=settle_name(self, self._task.currentText(), tasks) or None,
            author=self._author.settle(),
            rate=self.columns.rate.value() or None,
            jitter=self.jitter.value() / 1000,
            calibration=Path(calibration) if calibration else None,
            videos=self.videos.isChecked(),
        )
        files = self._listed()
        loose = _loose_videos(files)
        set_enabled_with_reason(self._go, "Wait until this is imported.")
        self._show_running(True)
        self._show_report()
        self._cancelled = Event()
        steps = importing(path, [file for file in files if file not in loose], options)
        self._jobs.run(
            _run_until(self._cancelled, steps),
            partial(self._imported, path, files, self.columns.choice()),
            self._failed,
            self._show_progress,
            key="import",
        )

    def _show_running(self, running: bool) -> None:
        self._running.setVisible(running)
        self._running.cancel.setEnabled(running)

    def _show_progress(self, progress: Progress) -> None:
        if not self._closed:
            self._running.bar.show_progress(progress)

    def _cancel(self) -> None:
        """Cancel the import; the dialog and its choices stay."""
        self._running.cancel.setEnabled(False)
        self._cancelled.set()

    def _imported(
        self, path: Path, files: Sequence[Path], choice: FileChoice, report: ImportReport | None
    ) -> None:
        """Report the import; files that failed or were added meanwhile stay in the list."""
        if report is not None:
            self._show_demonstrations(path, choice, report)
        if self._closed:
            return  # and deleted
        self._show_running(False)
        if report is None:
            self._changed()
            self._show_report(["The import was cancelled."])
            self._go.setFocus()
            return
        self._propose_project(())
        unread = report.unread
        remaining = [path for path in self._listed() if path not in files or path in unread]
        self._files.clear()
        if not remaining:
            self._task.setCurrentText("")  # the next files may show something else
        self.add_files(remaining)
        failures: list[str] = []
        if unread:
            failures.append("Left out because they could not be read:")
            failures += unread.values()
            failures.append("Press Delete to remove the selected files from the list.")
        videos = [
            f"{video.name} is a video: attach it by Demonstration > Attach video…"
            for video in _loose_videos(files)
        ]
        self._show_report([_count_line(report)], failures, [*videos, *report.remark_lines()])
        if unread:
            self._select(unread)
            return
        (self._go if remaining else self._close).setFocus()

    def _show_demonstrations(self, path: Path, choice: FileChoice, report: ImportReport) -> None:
        """Show in the window what was imported into a project, which is opened if none is."""
        if report.demonstrations:
            _remember(choice)
        document = self._document
        if document.project is None and self._open_project is not None:
            self._open_project(path)
        document.reread()  # the open one may have new labels, its task other actions
        if not document.id and document.infos:
            document.open_demonstration(document.infos[0].id)
        if self._closed:
            text = f"{path.name}: {_count_line(report)} It was too late to cancel."
            document.show_message(text)

    def _failed(self, error: Exception) -> None:
        """Report why nothing was imported; select the files concerned."""
        if self._closed:
            return
        self._show_running(False)
        set_enabled_with_reason(self._go, "")
        self._select(error.files if isinstance(error, InputError) else ())
        self._show_report(failures=[str(error)])

    def _select(self, files: Collection[Path]) -> None:
        """Select files in the list, so that Delete removes them."""
        failed = [self._files.item(row) for row, p in enumerate(self._listed()) if p in files]
        if failed:
            self._files.clearSelection()
            for item in failed:
                item.setSelected(True)
            self._files.scrollToItem(failed[0])
            self._files.setFocus()

    def _show_report(
        self,
        lines: Sequence[str] = (),
        failures: Sequence[str] = (),
        remarks: Sequence[str] = (),
    ) -> None:
        """Show all of the report: what was repaired must be known."""
        parts = (lines, failures, remarks)
        for label, part in zip(self._report_labels, parts, strict=True):
            show_text(label, name_fields("\n".join(part), _FIELDS))
        self._report.setVisible(any(parts))
