"""Which tasks are trained on and tested: the list in the bar, and the dialog behind it."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QFormLayout,
    QGroupBox,
    QLabel,
    QRadioButton,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.document import Document
from forcelab.gui.layout import (
    dialog_buttons,
    fill_layout,
    set_enabled_with_reason,
    toned_label,
)
from forcelab.gui.review.trainer import OWN_MINIMUM, Trainer, default_author, default_folds
from forcelab.gui.review.training_preferences import TrainingChoice
from forcelab.gui.widgets import NAME_CHARACTERS, ElidedComboBox, combo_box
from forcelab.recognition.groups import GROUPS
from forcelab.text import task_text


class TaskChoiceDialog(QDialog):
    """Tasks to train on, and how they are tested; `trouble` says why this cannot be chosen."""

    def __init__(
        self, document: Document, choice: TrainingChoice, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Tasks to train and test on")
        self.document = document
        self.trouble = ""
        self._also_from = choice.also_from  # chosen in the bar
        self.tasks = tuple(dict.fromkeys(info.task for info in document.infos))
        self._refusal, self._explanation = toned_label("trouble"), QLabel(wordWrap=True)
        buttons, self.ok = dialog_buttons(self, "Use these tasks")
        fill_layout(
            QVBoxLayout(self),
            self._training_box(choice),
            self._testing_box(choice),
            self._actions_box(choice),
            self._coder_row(choice),
            self._explanation,
            self._refusal,
            1,
            buttons,
        )
        self.setMinimumWidth(28 * self.fontMetrics().height())
        self._follow()

    def choice(self) -> TrainingChoice:
        tasks = self._trained()
        across = self.across.isChecked()
        return TrainingChoice(
            tasks=tasks,
            test_task=str(self.test_task.currentData()) if across else None,
            author=self.coder.currentData() or None,
            apart=len(tasks) > 1 and not across and self.apart.isChecked(),
            folds=None if across else self._folds,
            also_from=None if across else self._also_from,
        )

    # What it is made of

    def _training_box(self, choice: TrainingChoice) -> QGroupBox:
        box = QGroupBox("Train on")
        column = QVBoxLayout(box)
        self.boxes: dict[str, QCheckBox] = {}
        for task in self.tasks:
            labelled, count = self._counts(task)
            check = QCheckBox(f"{task_text(task)} ({labelled} of {count} labelled)")
            check.setAccessibleName(f"Train on {task_text(task)}")
            check.setChecked(task in choice.tasks)
            check.toggled.connect(self._follow)
            column.addWidget(check)
            self.boxes[task] = check
        return box

    def _testing_box(self, choice: TrainingChoice) -> QGroupBox:
        """Leave one out, or a group, or test on another task."""
        self.leave_out = _radio_button("Leave each demonstration out in turn")
        groups = choice.folds or GROUPS
        self.in_groups = _radio_button(
            f"Leave them out in {groups} groups, quicker where there are many"
        )
        self.across = _radio_button("Test on another task:")
        self.test_task = combo_box("Task to test on", {})
        for task in self.tasks:
            self.test_task.addItem(task_text(task), task)
        at = self.test_task.findData(choice.test_task)
        across = choice.test_task is not None and at >= 0
        other = next((t for t in self.tasks if t not in choice.tasks), "")
        self.test_task.setCurrentIndex(at if across else max(self.test_task.findData(other), 0))
        self.test_task.currentIndexChanged.connect(self._follow)
        self._folds = choice.folds
        folds = self._usual_folds(choice) if choice.folds is None else choice.folds
        left_out = self.in_groups if folds else self.leave_out
        (self.across if across else left_out).setChecked(True)
        box = QGroupBox("Test")
        self.leave_out.toggled.connect(lambda on: self._leave_out(0, on))
        self.in_groups.toggled.connect(lambda on: self._leave_out(groups, on))
        self.across.toggled.connect(self._follow)
        column = fill_layout(QVBoxLayout(box), self.leave_out, self.in_groups, self.across)
        column.addWidget(self.test_task, 0, Qt.AlignmentFlag.AlignLeft)
        return box

    def _usual_folds(self, choice: TrainingChoice) -> int:
        """In how many groups demonstrations are left out unless the coder chooses."""
        author = choice.author or default_author(self.document, set(choice.tasks))
        return default_folds(self.document, choice.tasks, author)

    def _leave_out(self, folds: int, on: bool) -> None:
        if on:
            self._folds = folds

    def _actions_box(self, choice: TrainingChoice) -> QGroupBox:
        self.joined = _radio_button("are one: “grab” is “grab” in every task")
        self.apart = _radio_button("stay apart, by the task as a suffix")
        self.apart.setToolTip(
            "As for hard and soft objects: can their “grab” be told from each other?"
        )
        (self.apart if choice.apart else self.joined).setChecked(True)
        self._same = QGroupBox("Actions of the same name")
        self.apart.toggled.connect(self._follow)
        fill_layout(QVBoxLayout(self._same), self.joined, self.apart)
        return self._same

    def _coder_row(self, choice: TrainingChoice) -> QWidget:
        self._coder_box = QWidget()
        form = QFormLayout(self._coder_box)
        form.setContentsMargins(0, 0, 0, 0)
        usual = f"mine once I have completed {OWN_MINIMUM}, otherwise the coder with the most"
        self.coder = combo_box("Labels of", {usual: ""} | {name: name for name in self._coders()})
        self.coder.setCurrentIndex(max(self.coder.findData(choice.author or ""), 0))
        self.coder.currentIndexChanged.connect(self._follow)
        form.addRow("&Labels of", self.coder)
        return self._coder_box

    def _coders(self) -> tuple[str, ...]:
        """All coders who labelled something; while blind, only the coder himself."""
        document, project = self.document, self.document.project
        if project is None:
            return ()
        people = project.coding.coders()
        authors = dict.fromkeys(
            author
            for info in document.infos
            for author in info.labelled
            if author == document.author or not project.coding.is_blind(info.id, document.author)
        )
        return tuple(author for author in authors if author in people)

    def _counts(self, task: str) -> tuple[int, int]:
        """Labelled demonstrations of a task, and all of them."""
        infos = [info for info in self.document.infos if info.task == task]
        return sum(bool(info.labelled) for info in infos), len(infos)

    # What happens

    def _trained(self) -> tuple[str, ...]:
        return tuple(task for task, box in self.boxes.items() if box.isChecked())

    def _follow(self, *_: object) -> None:
        """Show what matters for this choice, and what is wrong with it."""
        tasks, across = self._trained(), self.across.isChecked()
        several = len(self.tasks) > 1
        set_enabled_with_reason(self.across, "" if several else "There is only one task.")
        self.test_task.setVisible(across)
        self._same.setVisible(len(tasks) > 1 and not across)
        self._coder_box.setVisible(self.coder.count() > 2)
        self.trouble = self._error_sentence(tasks)
        self._refusal.setText(self.trouble)
        self._refusal.setVisible(bool(self.trouble))
        self._explanation.setText("" if self.trouble else self._note(tasks))
        self._explanation.setVisible(not self.trouble)
        set_enabled_with_reason(self.ok, self.trouble)

    def _error_sentence(self, tasks: tuple[str, ...]) -> str:
        """Why this cannot be trained and tested; empty where it can."""
        if not tasks:
            return "Nothing is trained on; choose a task."
        test = self.test_task.currentData()
        if self.across.isChecked() and test in tasks:
            return (
                f"'{test}' is trained on and so cannot be tested; choose another task, or leave "
                "one demonstration out."
            )
        labelled = sum(self._counts(task)[0] for task in tasks)
        if not labelled:
            return "Nothing is labelled yet; label at least two actions first."
        if self.across.isChecked() and not self._counts(str(test))[0]:
            return f"Nothing of '{test}' is labelled, so it cannot be tested."
        return ""

    def _note(self, tasks: tuple[str, ...]) -> str:
        """What is chosen, and what will be left out of it."""
        if not self.across.isChecked() and sum(self._counts(task)[0] for task in tasks) < 2:
            return (
                "Only one demonstration is labelled, so nothing can be tested; a recogniser is "
                "trained all the same, and proposes labels for the others."
            )
        return f"Trained and tested: {choice_text(self.choice())}"


def choice_text(choice: TrainingChoice) -> str:
    """What is trained and tested, in a few characters: ``"hard + soft → foam"``."""
    title = " + ".join(map(task_text, choice.tasks))
    if choice.test_task is not None:
        return f"{title} → {task_text(choice.test_task)}"
    if choice.apart:
        return f"{title}, kept apart"
    return title


def _radio_button(text: str) -> QRadioButton:
    button = QRadioButton(text)
    button.setAccessibleName(text)
    return button


class TaskComboBox(ElidedComboBox):
    """The tasks of the project; below them, the page on which several are chosen."""

    def __init__(self, trainer: Trainer) -> None:
        super().__init__()
        self._trainer = trainer
        self._name = "Task to train on"
        self.set_name(self._name)
        self.activated.connect(self._chosen)

    def refresh(self) -> None:
        """List the tasks; the current one shows all that is trained and tested."""
        trainer = self._trainer
        tasks = trainer.tasks
        if [self.itemData(i) for i in range(self.count() - 1)] != list(tasks):
            self.clear()
            for task in tasks:
                self.addItem(task_text(task), task)
            self.addItem("Tasks and tests…", None)
        set_enabled_with_reason(self, "" if tasks else "No demonstration has been imported yet.")
        at = self.findData(trainer.task) if tasks else -1
        self.setCurrentIndex(max(at, 0) if tasks else -1)
        for index, task in enumerate(tasks):
            current = index == at
            self.setItemText(index, choice_text(trainer.choice) if current else task_text(task))

    def fit(self, roomy: bool) -> None:
        """Show up to twice as many characters where there is much room."""
        chosen = self.currentText()
        self.setToolTip(f"{self._name}: {chosen}" if chosen else "")
        most = 2 * NAME_CHARACTERS if roomy else NAME_CHARACTERS
        self.setMinimumContentsLength(min(max(len(chosen), NAME_CHARACTERS), most))

    def _chosen(self, index: int) -> None:
        task = self.itemData(index)
        if task is None:
            self._ask()
        else:
            self._trainer.set_task(str(task))
        self.refresh()

    def _ask(self) -> None:
        trainer = self._trainer
        if trainer.ready:
            dialog = TaskChoiceDialog(trainer.document, trainer.choice, self.window())
            dialog.accepted.connect(lambda: trainer.set_choice(dialog.choice()))
            dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            dialog.open()
