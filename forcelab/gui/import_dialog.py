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
    QDialogButtonBox,
    QDoubleSpinBox,
    QFormLayout,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QListWidget,
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
from forcelab.formats.signatures import is_lerobot_folder, lerobot_folder
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
    ProgressBar,
    copyable,
    fill_layout,
    push_button,
    resize_on_screen,
    set_enabled_with_reason,
    toned_label,
)
from forcelab.gui.text import name_fields, settle_name
from forcelab.gui.theme import colours
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
#: Free room above and below a choice, in pixels.
CELL_PADDING = 3
#: Columns that are shown at most: each has a list to choose from, which takes its time.
MOST_SHOWN = 1000
#: How many signals are named at most that are no axes of a force sensor.
OTHERS_NAMED = 4


#: The key of the job that previews a file, and the milliseconds after which that is said.
PREVIEW_JOB = "import columns"
_PREVIEW_MS = 300
#: Formats whose columns become channels under their names.
_TABLES = "table", "excel", "parquet"


@dataclass(frozen=True, slots=True)
class _ColumnPreview:
    """What a file's columns are read as, without choices and with them; or why they are not."""

    path: Path | None = None
    untouched: tuple[ColumnUse, ...] = ()
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
    result = known
    try:
        if result is None:
            format_ = identify(path).name
            rate = rate_in(path) if format_ == "table" else None
            found = preview(path, ReadOptions())
            result = _ColumnPreview(path, found, found, rate=rate, table=format_ in _TABLES)
        if chosen is None or not result.untouched:
            return replace(result, uses=result.untouched, trouble="")
        yield
        return replace(result, uses=preview(path, chosen), trouble="")
    except (InputError, OSError) as error:
        result = result or _ColumnPreview(path)
        return replace(result, uses=result.untouched, trouble=str(error))


class ImportColumns(QWidget):
    """What each column of a table, or array in a file, is read as; shown for one file.

    That is the first file at first. `table` has a row for each column: its name, its first cells,
    the choice, and the size of an array; arrays stand below the group that they are in. What was
    chosen for a file is proposed for the next one that has the same columns.
    """

    #: The samples a second that were given for a file of the same build.
    rate_proposed = Signal(float)
    #: The columns are shown as they are read now.
    previewed = Signal()

    def __init__(self, jobs: Jobs) -> None:
        super().__init__()
        self._jobs = jobs
        self._path: Path | None = None
        self._wishes: dict[str, Use] = {}
        self._units: dict[str, str] = {}
        self._preview = _ColumnPreview()
        self._rate = 0.0
        self._first = self._proposed = False
        self._waiting = QTimer(self, singleShot=True, interval=_PREVIEW_MS)
        self._waiting.timeout.connect(self._announce_preview)
        self.heading = QLabel(wordWrap=True)
        self.others = toned_label("warning")
        self.others.hide()
        self.table = QTableWidget(0, 5)
        self.table.setAccessibleName("Columns of the table")
        self.table.setHorizontalHeaderLabels(["Column", "First cells", "Read as", "Size", "Unit"])
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(2, QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(3, QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(4, QHeaderView.ResizeMode.ResizeToContents)
        header.moveSection(3, 1)
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
        self._path = next((file for file in files if _has_columns(file)), None)
        self._wishes.clear()
        self._units.clear()
        self._first, self._proposed = True, False
        self._fill()

    def show_file(self, path: Path) -> None:
        """Show the columns of another file, if it has any; choices hold for all files."""
        if path != self._path and _has_columns(path):
            self._path = path
            self._fill()

    def options(self, options: ReadOptions) -> ReadOptions:
        """Add the choices; what was not chosen is found in each file."""
        chosen = {use: name for name, use in self._wishes.items()}
        several: dict[Use, tuple[str, ...]] = {
            use: tuple(name for name, wish in self._wishes.items() if wish == use)
            for use in ("signal", "left out")
        }
        return replace(
            options,
            time=chosen.get("times"),
            counter=chosen.get("counter"),
            label=chosen.get("labels"),
            leave_out=several["left out"],
            signals=several["signal"],
            units=tuple(self._chosen_units.items()),
        )

    def wish(self, name: str, use: Use) -> None:
        """Read a column as something else."""
        uses = {column.name: column.use for column in self._preview.untouched}
        if use in ("times", "counter", "labels"):  # there is one of each
            self._wishes = {n: u for n, u in self._wishes.items() if u != use}
        if use in ("times", "counter"):  # one stands in for the other
            other: Use = "counter" if use == "times" else "times"
            self._wishes = {n: u for n, u in self._wishes.items() if u != other}
        self._wishes.pop(name, None)
        if uses.get(name) != use:
            self._wishes[name] = use
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

    def set_rate(self, rate: float) -> None:
        """Set the samples a second of files without times; 0 for none."""
        if rate != self._rate:
            self._rate = rate
            self._show_status()

    @property
    def uses(self) -> tuple[ColumnUse, ...]:
        """What each column is read as; while the file cannot be read so, what was chosen."""
        uses, wishes = self._preview.uses, self._wishes
        if not self._preview.trouble or not wishes:
            return uses
        # There is one of each of these: what was found gives way to what was chosen.
        taken = set(wishes.values()) & {"times", "counter", "labels"}
        found: dict[str, Use] = {
            column.name: "left out" if column.use in taken else column.use for column in uses
        }
        return tuple(replace(c, use=wishes.get(c.name, found[c.name])) for c in uses)

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
        chosen = self.options(ReadOptions()) if self._wishes else None
        same = self._preview.path == self._path and self._preview.untouched
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
        if self._first and (choice := _remembered(self._build)) is not None:
            self._first, self._proposed = False, True
            self._wishes, self._units = choice.wishes, choice.units
            self._fill()
            self.rate_proposed.emit(choice.rate)
            return
        self._first = False
        self.setVisible(bool(shown.uses))
        self._fill_table()
        self._show_status()
        self.previewed.emit()

    def _fill_table(self) -> None:
        """Make a row for each column, and one above those of a group of arrays."""
        arrays = any(column.size for column in self.uses)
        self.table.setColumnHidden(3, not arrays)
        unit_missing = [column.name for column in self.uses if self._lacks_unit(column)]
        self.table.setColumnHidden(4, not unit_missing)
        self.table.setHorizontalHeaderItem(0, QTableWidgetItem("Array" if arrays else "Column"))
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
                self.table.removeCellWidget(row, 2)
                self.table.setSpan(row, 0, 1, 5)
                row += 1
            for column in columns:
                name = column.name.removeprefix(group)
                name = f"{name} [{column.unit}]" if column.unit else name
                texts = ("      " * bool(group) + name, "   ".join(column.cells), "", column.size)
                self._fill_row(row, texts)
                self.table.setCellWidget(row, 2, _pad_columns(self._choice(column)))
                if column.name in unit_missing:
                    self.table.setCellWidget(row, 4, _pad_columns(self._unit_line(column.name)))
                else:
                    self.table.removeCellWidget(row, 4)
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
    def _build(self) -> str:
        """What files have in common whose columns have the same names and numbers of axes."""
        columns = sorted(
            (column.name, column.size.count("×")) for column in self._preview.untouched
        )
        return hashlib.sha256(json.dumps(columns).encode()).hexdigest()[:16] if columns else ""

    def choice(self) -> str:
        """What is chosen for files of this build, to be remembered once they are imported."""
        timed = any(column.use == "times" for column in self.uses)
        chosen = [self._build, self._wishes, 0.0 if timed else self._rate]
        return json.dumps([*chosen, self._chosen_units] if self._chosen_units else chosen)

    def _show_status(self) -> None:
        """Say which file is shown, and what is missing."""
        trouble = name_fields(self._preview.trouble, _FIELDS)
        self.heading.setText(trouble or self._file_sentence())
        wrong = trouble or not self._timed or not self._has_signals
        self.heading.setStyleSheet(f"color: {colours().warning}" if wrong else "")
        others = self._others_sentence()
        self.others.setText(others)
        self.others.setVisible(bool(others))

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
        rate = self._rate or self._preview.rate
        return bool(rate) or any(column.use == "times" for column in self.uses)

    def _file_sentence(self) -> str:
        """Which file this is and how its times are known."""
        name = self._path.name if self._path else ""
        if len(self.uses) > MOST_SHOWN:
            name += f" (the first {MOST_SHOWN:,} of {len(self.uses):,})"
        kinds = [column.use for column in self.uses]
        if not self._has_signals:
            return f"It is not plain which are the signals in {name}; choose them:"
        if self._timed and self._proposed and (self._wishes or self._units):
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
        if any(column.use == "times" for column in self._preview.untouched):
            return ""
        for column in self._preview.untouched:
            if column.use == "left out" and is_time_name(column.name) and any(column.cells):
                return column.name
        return ""

    def _lacks_unit(self, column: ColumnUse) -> bool:
        """Whether a column becomes a channel of its name whose unit the file does not state."""
        return self._preview.table and column.use == "signal" and not column.unit

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
        found = [other.use for other in self._preview.untouched if other.name == column.name]
        for use in dict.fromkeys((*found, column.use, *column.choices)):
            box.addItem("sample counter" if use == "counter" else use, use)
        box.setCurrentIndex(box.findData(column.use))
        box.activated.connect(lambda index: self.wish(column.name, box.itemData(index)))
        return box


def _pad_columns(choice: QWidget) -> QWidget:
    """A choice that does not touch those above and below it."""
    cell = QWidget()
    margins = 0, CELL_PADDING, 2 * CELL_PADDING, CELL_PADDING
    fill_layout(QHBoxLayout(cell), choice, margins=margins)
    return cell


#: How many builds of files are remembered.
_REMEMBERED = 100


class _FileChoice(NamedTuple):
    """What was chosen for files of a build."""

    build: str
    wishes: dict[str, Use]
    rate: float
    units: dict[str, str]


def _choices() -> list[_FileChoice]:
    """What was chosen for files of each build, the latest first."""
    choices = []
    for text in settings.strings("import/choices"):
        with suppress(ValueError, TypeError, AttributeError):
            build, wishes, rate, *units = json.loads(text)
            known = {str(n): use for n, use in wishes.items() if use in ANY_USE}
            named = {str(n): str(unit) for n, unit in (units[0] if units else {}).items()}
            choices.append(_FileChoice(str(build), known, min(max(float(rate), 0.0), 1e6), named))
    return choices


def _remembered(build: str) -> _FileChoice | None:
    """What was chosen for files of a build; None where nothing was."""
    return next((choice for choice in _choices() if choice.build == build), None)


def _remember(choice: str) -> None:
    """Remember what was chosen for files of a build; what is found by itself is no choice."""
    build, *chosen = json.loads(choice)
    others = [json.dumps(other) for other in _choices() if other.build != build]
    latest = [choice] if build and any(chosen) else []
    settings.store("import/choices", [*latest, *others][:_REMEMBERED])


def _group(column: ColumnUse) -> str:
    """The group that an array is in, with its separator; empty for what is in none."""
    bare = re.sub(r" \d+$", "", column.name)
    return column.name[: max(bare.rfind("/"), bare.rfind(".")) + 1] if column.size else ""


def _has_columns(path: Path) -> bool:
    """Whether a file has columns, or what is like them."""
    try:
        return identify(path).columns
    except (InputError, OSError):
        return False  # what is wrong is told when the file is read


def _is_archive(path: Path) -> bool:
    """Whether a file is a project's archive, which names the task of each recording."""
    try:
        return identify(path).name == "archive"
    except (InputError, OSError):
        return False  # what is wrong is told when the file is read


def _loose_videos(files: Sequence[str]) -> list[str]:
    """The videos among recordings that belong to none of them by name."""
    unpaired, _ = pair_videos([Path(file) for file in files])
    loose = [str(path) for path in unpaired if is_video(path)]
    return loose if len(loose) < len(unpaired) else []


def _video_lines(files: Sequence[str]) -> list[str]:
    """What to do with the videos that belong to no recording."""
    return [
        f"{Path(file).name} is a video: attach it by Demonstration > Attach video…"
        for file in _loose_videos(files)
    ]


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


_GOES_ON = "Wait until this is imported."


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
        self._waits = False
        self._files.currentTextChanged.connect(self._look_at)
        self._bar = ProgressBar("Progress of the import")
        self._stop = push_button("Cancel", self._cancel, "Cancel the import")
        self._show_running(False)
        running = fill_layout(QHBoxLayout(), (self._bar, 1), self._stop)
        column = fill_layout(
            QVBoxLayout(self), self._heading(), (self._files, 1), (self.columns, 3), self._form()
        )
        fill_layout(column, self._taskless, running, (self._result(), 3), self._button_row())
        # Only now: a button that is in no dialog yet cannot be its default.
        self._go.setDefault(True)
        self._warn()
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
        label = QLabel(kinds, wordWrap=True)
        return fill_layout(QHBoxLayout(), (label, 1), self._pick)

    def _form(self) -> QFormLayout:
        """What the files do not say themselves."""
        document = self._document
        self.open_project_name = QLabel(wordWrap=True, textFormat=Qt.TextFormat.PlainText)
        self._task = QComboBox(editable=True)
        self._task.setAccessibleName("Task")
        self._task.addItems(document.project.demonstrations.tasks() if document.project else ())
        # Of no task until one is chosen: the last one is seldom what is done in the next files.
        self._task.setCurrentText("")
        self._task.currentTextChanged.connect(self._warn)
        self._author = UnsignedCoder(document, ReadOptions().author)
        self._rate = QDoubleSpinBox(maximum=1e6, suffix=" Hz")
        self._rate.setSpecialValueText("from the time column")
        self._rate.setAccessibleName("Sample rate of files without times")
        self._rate.valueChanged.connect(self.columns.set_rate)
        self.columns.rate_proposed.connect(self._rate.setValue)
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
        form.addRow("Sample rate, where files have no times", self._rate)
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
        recordings = Path(files[0]).absolute().parent
        folder = recordings if os.access(recordings, os.W_OK) else settings.documents_folder()
        archive = len(files) == 1 and _is_archive(Path(files[0]))
        name = Path(files[0]).stem if archive else recordings.name
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

    def _button_row(self) -> QDialogButtonBox:
        self._buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close, self)
        self._go = self._buttons.addButton("Import", QDialogButtonBox.ButtonRole.ActionRole)
        self._go.clicked.connect(self._import)
        self._buttons.rejected.connect(self.reject)
        return self._buttons

    def add_files(self, files: Sequence[Path]) -> None:
        listed = set(self._chosen())
        files = [
            f if not is_lerobot_folder(lerobot_folder(f)) else lerobot_folder(f) for f in files
        ]
        self._files.addItems([str(path) for path in files if str(path) not in listed])
        for row in range(len(listed), self._files.count()):
            self._files.item(row).setToolTip(self._files.item(row).text())
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

    def _look_at(self, name: str) -> None:
        """Show the columns of the selected file."""
        if name:
            self.columns.show_file(Path(name))

    def _chosen(self) -> list[str]:
        """The files in the list."""
        return [self._files.item(row).text() for row in range(self._files.count())]

    def _changed(self) -> None:
        """Follow a change of the list of files."""
        files = self._chosen()
        reason = "" if files else "Add files first."
        set_enabled_with_reason(self._go, reason if self._bar.isHidden() else _GOES_ON)
        self._show_report()  # it was of files that were in the list before
        datasets = [Path(name) for name in files if is_lerobot_folder(Path(name))]
        others = (Path(name) for name in files if Path(name) not in datasets)
        self._tasks_named = bool(files) and all(_is_archive(path) for path in others)
        self._layout.setRowVisible(self.episodes, bool(datasets))
        count = stated_episodes(datasets[0]) if len(datasets) == 1 else ""
        self.episodes.setPlaceholderText(" ".join(f"all {count}".split()) + ", or such as 0-9, 12")
        task = self._task.lineEdit()
        if task is not None:
            source = "dataset" if datasets else "archive"
            task.setPlaceholderText(f"as the {source} says" if self._tasks_named else "")
        self._warn()
        self.columns.show_first([Path(name) for name in files])

    def _import_when_previewed(self) -> None:
        if self._waits:
            self._import()

    def _import(self) -> None:
        """Import in the background, once it is known what the columns are read as."""
        self._waits = self.columns.previewing
        if self._waits:
            return
        path, project = self._project_path(), self._document.project
        tasks = () if project is None else project.demonstrations.tasks()
        calibration = self.calibration.text().strip()
        try:
            episodes = parse_episodes(self.episodes.text())
        except InputError as error:
            self._failed(error)
            return
        options = ReadOptions(
            episodes=episodes,
            task=settle_name(self, self._task.currentText(), tasks) or None,
            author=self._author.settle() or ReadOptions().author,
            rate=self._rate.value() or None,
            jitter=self.jitter.value() / 1000,
            calibration=Path(calibration) if calibration else None,
            videos=self.videos.isChecked(),
        )
        options, files = self.columns.options(options), self._chosen()
        loose = set(_loose_videos(files))
        set_enabled_with_reason(self._go, _GOES_ON)
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
        self._bar.setVisible(running)
        self._stop.setVisible(running)
        self._stop.setEnabled(running)

    def _show_progress(self, progress: Progress) -> None:
        if not self._closed:
            self._bar.show_progress(progress)

    def _cancel(self) -> None:
        """Cancel the import; the dialog and its choices stay."""
        self._stop.setEnabled(False)
        self._cancelled.set()

    def _imported(
        self, path: Path, files: Sequence[str], choice: str, report: ImportReport | None
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
        unread = set(map(str, report.unread))
        remaining = [Path(name) for name in self._chosen() if name not in files or name in unread]
        self._files.clear()
        if not remaining:
            self._task.setCurrentText("")  # the next files may show something else
        self.add_files(remaining)
        failures: list[str] = []
        if unread:
            failures.append("Left out because they could not be read:")
            failures += report.unread.values()
            failures.append("Press Delete to remove the selected files from the list.")
        remarks = *_video_lines(files), *report.remark_lines()
        self._show_report([_count_line(report)], failures, remarks)
        if unread:
            self._select(unread)
            return
        close = self._buttons.button(QDialogButtonBox.StandardButton.Close)
        (self._go if remaining else close).setFocus()

    def _show_demonstrations(self, path: Path, choice: str, report: ImportReport) -> None:
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
        unread = set(map(str, error.files)) if isinstance(error, InputError) else set()
        self._select(unread)
        self._show_report(failures=[str(error)])

    def _select(self, names: Collection[str]) -> None:
        """Select files in the list, so that Delete removes them."""
        items = [self._files.item(row) for row in range(self._files.count())]
        failed = [item for item in items if item.text() in names]
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
            label.setText(name_fields("\n".join(part), _FIELDS))
            label.setVisible(bool(part))
        self._report.setVisible(any(parts))
