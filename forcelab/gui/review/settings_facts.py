"""What demonstrations say about settings: channels, rate, spellings, and what training costs."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median_low
from typing import TYPE_CHECKING

from forcelab.gui.document import Document
from forcelab.gui.review.wanted import whose_labels

if TYPE_CHECKING:
    from forcelab.recognition.dataset import Choice
    from forcelab.recognition.settings import Settings

__all__ = ["Facts", "facts_of"]


@dataclass(frozen=True, slots=True)
class Facts:
    """What the demonstrations that are trained on have in common.

    Parameters
    ----------
    channels : tuple of str
        Recognition channels that all of them have.
    rate : float
        Their median rate in Hz; 0 without a demonstration.
    labelled : float
        Seconds that are labelled by whom they are trained on.
    spellings : frozenset of str
        All actions as they are spelt.
    """

    channels: tuple[str, ...] = ()
    rate: float = 0.0
    labelled: float = 0.0
    spellings: frozenset[str] = frozenset()

    def cost(self, settings: Settings) -> tuple[int, int]:
        """Numbers that describe a time step, and labelled steps that are trained on."""
        channels = self.channels if settings.channels is None else settings.channels
        rate = settings.rate or self.rate
        features = settings.width(len(channels))
        steps = rate / settings.hop(rate) if rate else 0.0
        return features, round(self.labelled * steps / settings.stride)


def facts_of(document: Document, choice: Choice) -> Facts:
    """The facts of what is chosen, from the list of demonstrations; opens no array."""
    from forcelab.signals.channels import channel_map

    if document.project is None:
        return Facts()
    # From the store: what was painted a moment ago is not in the window's list yet.
    infos = [info for info in document.project.demonstrations() if info.task in choice.tasks]
    if not infos:
        return Facts()
    maps = [channel_map(info.channels).names for info in infos]
    common = set.intersection(*map(set, maps))
    author = choice.author or whose_labels(document, {*choice.tasks, choice.test_task})
    spelt = frozenset[str]().union(
        *(document.project.painted_actions(task) for task in choice.tasks)
    )
    return Facts(
        channels=tuple(name for name in maps[0] if name in common),
        rate=median_low(info.rate for info in infos),
        labelled=sum(info.labelled.get(author, 0.0) for info in infos) if author else 0.0,
        spellings=spelt,
    )
