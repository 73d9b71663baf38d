"""The list of the tasks, in which the one that is trained on is chosen, or several."""

from __future__ import annotations

from PySide6.QtCore import Qt

from forcelab.gui.review.learning import Learning
from forcelab.gui.review.narrow_list import NAME, NarrowList
from forcelab.gui.review.task_choice import TaskChoiceDialog, choice_name
from forcelab.gui.review.wanted import shown_task

__all__ = ["TaskList"]


class TaskList(NarrowList):
    """The tasks of the project; below them, the page on which several are chosen."""

    def __init__(self, learning: Learning) -> None:
        super().__init__()
        self._learning = learning
        self._name = "Task to train on"
        self.set_name(self._name)
        self.activated.connect(self._chosen)

    def refresh(self) -> None:
        """List the tasks that there are, the one at hand by all that is trained and tested."""
        learning = self._learning
        tasks = learning.tasks
        if [self.itemData(i) for i in range(self.count() - 1)] != list(tasks):
            self.clear()
            for task in tasks:
                self.addItem(shown_task(task), task)
            self.addItem("Tasks and tests…", None)
        self.setEnabled(bool(tasks))
        at = self.findData(learning.task) if tasks else -1
        self.setCurrentIndex(max(at, 0) if tasks else -1)
        for index, task in enumerate(tasks):
            here = index == at
            self.setItemText(index, choice_name(*learning.chosen) if here else shown_task(task))

    def fit(self, roomy: bool) -> None:
        """Show up to twice as many characters of what is chosen where there is much room."""
        chosen = self.currentText()
        self.setToolTip(f"{self._name}: {chosen}" if chosen else "")
        self.setMinimumContentsLength(min(max(len(chosen), NAME), 2 * NAME) if roomy else NAME)

    def _chosen(self, index: int) -> None:
        """Turn to a task, or choose several."""
        task = self.itemData(index)
        if task is None:
            self._ask()
        else:
            self._learning.set_task(str(task))
        self.refresh()

    def _ask(self) -> None:
        """Let the coder choose what is trained on and what is tested."""
        learning = self._learning
        if learning.ready:
            dialog = TaskChoiceDialog(learning.document, learning.choice, self.window())
            dialog.accepted.connect(lambda: learning.set_choice(dialog.form.choice()))
            dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            dialog.open()
