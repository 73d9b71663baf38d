"""Two coders compared: every figure with a sentence that says what it means, and the places."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QPalette
from PySide6.QtWidgets import QHBoxLayout, QLabel, QVBoxLayout, QWidget

from forcelab.gui.arranging import copyable, stress
from forcelab.gui.document import Document
from forcelab.gui.review.coders_histogram import ActionBars, OffsetHistogram
from forcelab.gui.review.coders_matrix import word
from forcelab.gui.review.coders_places import PlaceRow, PlaceTable
from forcelab.gui.review.confusion_switches import choice

if TYPE_CHECKING:
    from forcelab.review.agreement import PairAgreement

__all__ = ["PairDetails", "sentence"]

#: How many places are listed at most; the rest are shorter than all of these.
MOST = 2000


def sentence(muted: bool = False) -> QLabel:
    """A label that wraps; its text can be selected with the mouse."""
    label = copyable()
    label.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    if muted:
        label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
    return label


class PairDetails(QWidget):
    """What two coders agree on, and where they do not."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self._pair: PairAgreement | None = None
        self._names: Mapping[str, str] = {}
        self.title = sentence()
        stress(self.title)
        self.frames, self.alone = sentence(), sentence()
        self.each, self.bars = sentence(), ActionBars()
        self.offsets, self.histogram = sentence(), OffsetHistogram()
        self.segments = sentence()
        self.kinds = choice(
            "Which places are listed",
            {
                "All differences": "all",
                "Different actions": "apart",
                "Only one labelled": "alone",
                "Boundaries moved": "shifted",
            },
        )
        self.kinds.activated.connect(lambda _: self._list())
        self.places = PlaceTable("Places where the two differ")
        self.places.wanted.connect(document.examine)
        self._count = sentence(muted=True)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        shown: tuple[QWidget, ...] = (self.title, self.frames, self.alone, self.each, self.bars)
        for widget in (*shown, self.offsets, self.histogram, self.segments):
            column.addSpacing(4 if widget in (self.each, self.offsets, self.segments) else 0)
            column.addWidget(widget)
        row = QHBoxLayout()
        row.addWidget(self.kinds)
        row.addWidget(self._count, 1)
        column.addSpacing(4)
        column.addLayout(row)
        column.addWidget(self.places, 1)

    def show_pair(self, pair: PairAgreement, names: Mapping[str, str]) -> None:
        """Show two coders; `names` are the demonstrations' by id."""
        self._pair, self._names = pair, names
        self._tell_frames(pair)
        self._tell_actions(pair)
        self._tell_boundaries(pair)
        self._tell_segments(pair)
        self._list()

    def _tell_frames(self, pair: PairAgreement) -> None:
        """Say how much of the time they agree."""
        many = "{0} and {1}, {2} demonstrations"
        one = "{0} and {1}, 1 demonstration"
        count = len(pair.demonstrations)
        self.title.setText((one if count == 1 else many).format(pair.a, pair.b, count))
        kappa, agreed = pair.kappa, pair.agreed
        if agreed is None:
            text = "There is no time that both labelled, so nothing can be compared."
        elif kappa is None:
            text = "Both know one action only; kappa cannot tell that from chance."
        else:
            text = (
                f"Kappa {kappa:.2f}, “{word(kappa)}” by Landis and Koch: they say the same "
                f"{_share(agreed)} of the time, and "
                "kappa is what of that goes beyond chance (0 is chance, 1 is always)."
            )
            if (interval := pair.interval) is not None:
                text += " " + "Other demonstrations would give {:.2f} to {:.2f} (95 %).".format(
                    *interval
                )
        self.frames.setText(text)
        first, second = pair.only
        self.alone.setText(
            f"{_share(pair.only_share)} of the labelled time only one of them labelled "
            f"({pair.a} {first:.1f} s, {pair.b} {second:.1f} s);"
            " it enters neither kappa nor the figures of actions and segments."
        )

    def _tell_actions(self, pair: PairAgreement) -> None:
        """Say how each action agrees."""
        self.each.setText("Actions: where one of the two says it, how often the other says it too.")
        self.bars.show_shares(pair.by_action, self.document.vocabulary)

    def _tell_boundaries(self, pair: PairAgreement) -> None:
        """Say how far boundaries lie apart."""
        from forcelab.review.agreement import WINDOW

        quartiles = pair.quartiles
        self.histogram.setVisible(quartiles is not None)
        if quartiles is None:
            text = "Boundaries: no two are within {0:.0f} ms of each other."
            self.offsets.setText(text.format(1000 * WINDOW))
            return
        low, middle, high = quartiles
        when = "later" if round(middle) >= 0 else "earlier"
        text = (
            "Boundaries: {0} puts the same boundary {1:.0f} ms {2} than {3} (median; half of them "
            "lie from {4} to {5} ms). {6}. Matched, at most {8:.0f} ms apart: {7} of the {9} and "
            "{10} there are."
        )
        near = ", ".join(f"{_share(share)} within {ms} ms" for ms, share in pair.within.items())
        mine, theirs = pair.boundaries
        self.offsets.setText(
            text.format(
                pair.b,
                abs(middle),
                when,
                pair.a,
                _signed(low),
                _signed(high),
                near,
                len(pair.offsets),
                1000 * WINDOW,
                mine,
                theirs,
            )
        )
        self.histogram.show_offsets(pair.offsets, pair.b)

    def _tell_segments(self, pair: PairAgreement) -> None:
        """Say how many segments find their counterpart."""
        f1 = ", ".join(
            f"{_share(value)} at {overlap} %"
            for overlap, value in pair.f1.items()
            if value is not None
        )
        self.segments.setText(
            (
                "Segments (F1): {}. 100 % means that every segment has one of the same "
                "action in the "
                "other track that it overlaps by at least so much."
            ).format(f1 or "–")
        )

    def _list(self) -> None:
        """List the places of the chosen kind, the longest first."""
        pair, kind = self._pair, self.kinds.currentData()
        if pair is None:
            return
        kinds = {
            "apart": (pair.apart, "different actions"),
            "alone": (pair.alone, "only one labelled"),
            "shifted": (pair.shifted, "boundary moved"),
        }
        chosen = ("apart", "alone") if kind == "all" else (kind,)
        rows = [PlaceRow(place, kinds[name][1]) for name in chosen for place in kinds[name][0]]
        rows.sort(key=lambda row: -row.place.duration)
        count = f"{len(rows)}, the longest first"
        self._count.setText(count if rows else "There are none.")
        self.places.setVisible(bool(rows))
        self.places.put(rows[:MOST], self._names, (pair.a, pair.b, "What"))


def _share(share: float) -> str:
    """A share in percent with a decimal; never 100.0 where it is not all."""
    shown = min(100 * share, 99.9) if share < 1 else 100.0
    return f"{shown:.1f}\N{NO-BREAK SPACE}%"


def _signed(ms: float) -> str:
    """Whole milliseconds with their sign; none at zero."""
    return f"{ms:+.0f}".replace("-", "\N{MINUS SIGN}") if round(ms) else "0"
