"""The colours of the window: a set for the light theme, and one for the dark."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtGui import QColor

from forcelab.gui.figures.canvas import Theme

__all__ = ["DARK", "LIGHT", "Colours"]


@dataclass(frozen=True)
class Colours(Theme):
    """The colours of the window, each as ``"#rrggbb"``.

    Text and muted text can be read on `background`, `panel` and `panel_edge`; `on_unlabelled` is
    the text for unlabelled time.

    Parameters
    ----------
    on_unlabelled : str
        Text and lines on unlabelled time.
    panel, panel_edge : str
        Behind docks, tool bars and gutters; the lines and buttons on them.
    accent, accent_text : str
        What is selected or pressed; text on it.
    warning, trouble : str
        Sentences that warn, and that say what went wrong.
    curves : tuple of str
        Eight colours of curves on `background`, found by a search: at least 24 apart (CIE76) for
        normal and simulated colour-blind vision (Machado, Oliveira and Fernandes 2009). The same
        place has a similar hue in both themes.
    cursor : str
        The line at the cursor; seen on `background` and on unlabelled time.
    range, hint : str
        The marked range (drawn translucent); where an edge would snap.
    """

    on_unlabelled: str
    panel: str
    panel_edge: str
    accent: str
    accent_text: str
    warning: str
    trouble: str
    curves: tuple[str, ...]
    cursor: str
    range: str
    hint: str

    @property
    def dark(self) -> bool:
        """Whether text is lighter than its ground."""
        return QColor(self.text).lightnessF() > QColor(self.background).lightnessF()


LIGHT = Colours(
    background="#ffffff",
    text="#1c1f24",
    muted="#565d68",
    grid="#e7e9ed",
    frame="#aab0ba",
    unlabelled="#ffffff",
    on_unlabelled="#1c1f24",
    panel="#f3f4f6",
    panel_edge="#dfe2e7",
    accent="#1f64b4",
    accent_text="#ffffff",
    warning="#8a5300",
    trouble="#b3261e",
    curves=(
        "#258cf4",
        "#da730b",
        "#4c0891",
        "#f42559",
        "#054a61",
        "#59500d",
        "#c76bb0",
        "#590d20",
    ),
    cursor="#d3202e",
    range="#1f64b4",
    hint="#a8348f",
)

#: Unlabelled time stays light in the dark theme: the actions' colours, black among them, were
#: chosen for a white ground and keep their meaning only on one. Softened, so that an empty track
#: does not glare; on no dark ground are black and blue both seen.
DARK = Colours(
    background="#16191e",
    text="#e6e8ec",
    muted="#a3aab5",
    grid="#2a2f37",
    frame="#59616d",
    unlabelled="#ced3da",
    on_unlabelled="#1c1f24",
    panel="#1f2329",
    panel_edge="#343a44",
    accent="#2f74c8",
    accent_text="#ffffff",
    warning="#f0b75a",
    trouble="#ff8a80",
    curves=(
        "#85a7e0",
        "#da8d0b",
        "#8a5cd6",
        "#e2368c",
        "#55f6f6",
        "#c4f76e",
        "#ebd4ad",
        "#1f7a36",
    ),
    cursor="#dc343b",
    range="#5aa9ff",
    hint="#c83ca0",
)
