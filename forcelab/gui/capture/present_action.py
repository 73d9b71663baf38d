"""The present action, large, and how probable each one is."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.gui.capture.session import Session
from forcelab.gui.figures import text
from forcelab.gui.label.swatches import look_of, paint_swatch
from forcelab.gui.theme import colours

__all__ = ["PresentAction"]

#: Height of a bar's row, width of a cell at least, and rows at least and at most, in pixels.
ROW, CELL, FEWEST, MOST = 17, 128, 3, 6
#: Width of a cell at most, in pixels: a longer bar tells no more.
WIDEST = 240
#: Probability above which an action is likelier than all others together.
LIKELY = 0.5
#: Width of what is left for the present action, in pixels.
LARGE = 190


class PresentAction(QWidget):
    """The action of the latest label, and a bar for each that the recogniser knows.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self._said = ""
        self.setToolTip(
            "Large: the action of the latest label, as it is kept. Bars: how probable each "
            "action is by itself, before the filters or the decoder decide."
        )
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.refresh()

    def sizeHint(self) -> QSize:
        """As high as the bars need, within bounds."""
        loaded = self._session.recognising.loaded
        count = 0 if loaded is None else len(loaded.recogniser.actions)
        columns = max(1, (max(self.width(), 480) - LARGE) // CELL)
        rows = min(max(-(-count // columns), FEWEST), MOST)
        return QSize(480, rows * ROW + 2)

    def minimumSizeHint(self) -> QSize:
        """Narrow, but as high as it is."""
        return QSize(240, self.sizeHint().height())

    def refresh(self) -> None:
        """Another recogniser, other actions."""
        self.updateGeometry()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the action and the bars."""
        with QPainter(self) as painter:
            glimpse = self._session.recognising.glimpse
            action = "" if glimpse is None or not self._session.connected else glimpse.action
            self._tell(action)
            loaded = self._session.recognising.loaded
            known = glimpse.probabilities if glimpse is not None else ()
            self._paint_action(painter, action, self.explained(action, known))
            if loaded is not None:
                self._paint_bars(painter, loaded.recogniser.actions, known)

    def explained(self, action: str, known: tuple[float, ...]) -> str:
        """Who decided for an action although another one is the likelier; empty where none is.

        Parameters
        ----------
        action : str
            Of the latest label; empty where that is unlabelled.
        known : tuple of float
            The probability of each action that the recogniser knows, as far as it tells them.
        """
        loaded = self._session.recognising.loaded
        if loaded is None or max(known, default=0.0) <= LIKELY:
            return ""
        if loaded.recogniser.actions[known.index(max(known))] == action:
            return ""
        if loaded.recogniser.settings.decodes:
            return "as the decoder decides"
        return "as the filters decide"

    def _tell(self, action: str) -> None:
        """For those who do not see it."""
        if action != self._said or not self.accessibleName():
            self._said = action
            self.setAccessibleName(f"Present action: {action or self._none()}")

    def _none(self) -> str:
        return "unlabelled"

    def _paint_action(self, painter: QPainter, action: str, explained: str) -> None:
        box = QRectF(0, 1, LARGE - 16, self.height() - 2)
        swatch = QRectF(box.left(), box.center().y() - 15, 30, 30)
        theme = colours()
        face = text.font(22.0, bold=True)
        if action:
            paint_swatch(painter, swatch, look_of(self._session.seen_vocabulary, action))
        else:
            painter.setPen(QColor(theme.frame))
            painter.setBrush(QColor(theme.unlabelled))
            painter.drawRect(swatch.adjusted(0, 0, -1, -1))
        room = box.right() - swatch.right() - 10
        said = text.elided(action, face, room) if action else self._none()
        ink = QColor(theme.text if action else theme.muted)
        face = face if action else text.font(14.0)
        text.put(painter, swatch.right() + 10, swatch.center().y(), said, face=face, ink=ink)
        face, below = text.font(10.0), swatch.bottom() + 4
        said = text.elided(explained, face, room)
        text.put(painter, swatch.right() + 10, below, said, face=face, ink=QColor(theme.muted))

    def _paint_bars(
        self, painter: QPainter, actions: tuple[str, ...], known: tuple[float, ...]
    ) -> None:
        """Name, bar and number of each action, in columns."""
        theme, vocabulary = colours(), self._session.seen_vocabulary
        rows = max(1, (self.height() - 2) // ROW)
        columns = min(max(1, (self.width() - LARGE) // CELL), -(-len(actions) // rows))
        rows = min(rows, -(-len(actions) // columns))  # all columns of like height
        width = min((self.width() - LARGE) / columns, WIDEST)
        begin = (self.height() - rows * ROW) / 2
        face = text.font(10.0)
        number = text.width("100 %", face) + 14
        named = min(text.widest(actions, face) + 8, 0.55 * (width - number))
        for i, action in enumerate(actions[: rows * columns]):
            left, top = LARGE + (i // rows) * width, begin + (i % rows) * ROW
            share = known[i] if i < len(known) else 0.0
            middle = top + ROW / 2
            name = text.elided(action, face, named - 4)
            text.put(painter, left, middle, name, face=face, ink=QColor(theme.text))
            bar = QRectF(left + named, top + 4, width - named - number - 4, ROW - 8)
            painter.fillRect(bar, QColor(theme.grid))
            look = look_of(vocabulary, action)
            full = QRectF(bar.left(), bar.top(), bar.width() * share, bar.height())
            painter.fillRect(full, look.colour)
            painter.setPen(QColor(theme.frame))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(bar)
            if known:
                label = f"{100 * share:.0f} %"
                text.put(
                    painter, bar.right() + 5, middle, label, face=face, ink=QColor(theme.muted)
                )
