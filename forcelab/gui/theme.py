"""The window's theme: colours, light and dark, and the palette and style sheet made of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QColor, QFont, QGuiApplication, QPalette
from PySide6.QtWidgets import QApplication, QWidget

from forcelab.gui.figures.colormap import mixed
from forcelab.gui.figures.figure import Theme
from forcelab.gui.kit import text_size


@dataclass(frozen=True)
class Colours(Theme):
    """The colours of the window, each as ``"#rrggbb"``.

    Text and muted text can be read on `background`, `panel` and `panel_edge`; `on_unlabelled` is
    the text for unlabelled time.

    `curves` are eight colours of curves on `background`, found by a search: at least 24 apart
    (CIE76) for normal and simulated colour-blind vision (Machado, Oliveira and Fernandes 2009). The
    same place has a similar hue in both themes.
    """

    on_unlabelled: str  # text and lines on unlabelled time
    panel: str  # behind docks, tool bars and gutters
    panel_edge: str  # the lines and buttons on them
    accent: str  # what is selected or pressed
    accent_text: str  # on what is selected or pressed
    warning: str  # sentences that warn
    trouble: str  # sentences that say what went wrong
    curves: tuple[str, ...]
    cursor: str  # the line at the cursor; seen on `background` and on unlabelled time
    range: str  # the marked range, drawn translucent
    hint: str  # where an edge would snap

    @property
    def dark(self) -> bool:
        """Whether text is lighter than its background."""
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
    curves=("#258cf4", "#da730b", "#4c0891", "#f42559", "#054a61", "#59500d", "#c76bb0", "#590d20"),
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
    curves=("#85a7e0", "#da8d0b", "#8a5cd6", "#e2368c", "#55f6f6", "#c4f76e", "#ebd4ad", "#1f7a36"),
    cursor="#dc343b",
    range="#5aa9ff",
    hint="#c83ca0",
)


#: Widgets that get a frame of their own (:func:`framed`).
FRAMED = (
    "QAbstractSpinBox",
    "QComboBox",
    "QCheckBox",
    "QRadioButton",
    "QListView",
    "QTableView",
    "QTreeView",
    "QTextEdit",
    "QPlainTextEdit",
)


class _Themes(QObject):
    """The theme in use; follows the system if that is the choice."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.choice = "system"
        self.colours = LIGHT
        self._begun = False

    def apply(self, app: QApplication, choice: str) -> None:
        """Use a theme, and follow the system if that is the choice."""
        self.choice = choice
        hints = QGuiApplication.styleHints()
        if not self._begun:
            app.setStyle("Fusion")
            hints.colorSchemeChanged.connect(self._follow)
            self._begun = True
        # What the system draws, such as the window's frame, goes along.
        schemes = {"light": Qt.ColorScheme.Light, "dark": Qt.ColorScheme.Dark}
        hints.setColorScheme(schemes.get(choice, Qt.ColorScheme.Unknown))
        self._apply_colours(app)

    def _follow(self) -> None:
        """Follow the system between light and dark."""
        app = QApplication.instance()
        if self.choice == "system" and isinstance(app, QApplication):
            self._apply_colours(app)

    def _apply_colours(self, app: QApplication) -> None:
        """Give the application the colours of the choice."""
        dark = self.choice == "dark"
        if self.choice == "system":
            dark = _system() == Qt.ColorScheme.Dark
        self.colours = DARK if dark else LIGHT
        app.setPalette(palette(self.colours))
        for kind in FRAMED:
            app.setPalette(framed(self.colours), kind)  # type: ignore[arg-type]  # its stub is wrong
        # What a box unfolds takes no colours from it: it is framed as menus are.
        app.setPalette(palette(self.colours), "QComboBoxPrivateContainer")  # type: ignore[arg-type]
        self.changed.emit()


@cache
def themes() -> _Themes:
    """The object whose `changed` says that :func:`colours` returns others now."""
    return _Themes()


def colours() -> Colours:
    """The colours in use."""
    return themes().colours


def use_theme(app: QApplication, choice: str) -> None:
    """Give the application a theme: Fusion and a palette; ``"system"`` follows the system.

    Its windows get the style sheet from :func:`apply_to_application`.
    """
    themes().apply(app, choice)


def apply_to_application(window: QWidget) -> None:
    """Give a window, and all that belongs to it, the style sheet of the theme.

    Widgets with a style sheet are styled again each time they get another parent. On the
    application, instead of on windows that are complete, it would double what that takes.
    """
    window.setStyleSheet(_sheet(colours()))


def _system() -> Qt.ColorScheme:
    """The system's scheme; unknown if it has none."""
    return QGuiApplication.styleHints().colorScheme()


def palette(colours: Colours) -> QPalette:
    """All colours that Qt's own widgets ask for."""
    role = QPalette.ColorRole
    edge, panel = colours.panel_edge, colours.panel
    deep = "#000000" if colours.dark else colours.text
    normal = {
        role.Window: QColor(panel),
        role.WindowText: QColor(colours.text),
        role.Base: QColor(colours.background),
        role.AlternateBase: mixed(colours.background, panel, 0.6),
        role.Text: QColor(colours.text),
        role.PlaceholderText: QColor(colours.muted),
        role.Button: mixed(panel, edge, 0.35),
        role.ButtonText: QColor(colours.text),
        role.BrightText: QColor(colours.trouble),
        role.ToolTipBase: QColor(colours.background),
        role.ToolTipText: QColor(colours.text),
        role.Highlight: QColor(colours.accent),
        role.HighlightedText: QColor(colours.accent_text),
        role.Accent: QColor(colours.accent),
        role.Link: QColor(colours.curves[0] if colours.dark else colours.accent),
        role.LinkVisited: QColor(colours.curves[3]),
        role.Light: mixed(panel, colours.text if colours.dark else "#ffffff", 0.12),
        role.Midlight: mixed(panel, edge, 0.5),
        role.Mid: QColor(edge),
        role.Dark: QColor(colours.frame),
        role.Shadow: mixed(panel, deep, 0.6),
    }
    texts = (role.WindowText, role.Text, role.ButtonText, role.PlaceholderText)
    disabled = dict.fromkeys(texts, mixed(colours.text, panel, 0.55)) | {
        role.Base: QColor(panel),
        role.Highlight: QColor(colours.frame),
        role.Accent: QColor(colours.frame),
        role.HighlightedText: QColor(colours.background),
    }
    result = QPalette()
    for colour_role, colour in normal.items():
        result.setColor(colour_role, colour)
    for colour_role, colour in disabled.items():
        result.setColor(QPalette.ColorGroup.Disabled, colour_role, colour)
    return result


def framed(colours: Colours) -> QPalette:
    """The palette of input fields: their frame can be seen in either theme.

    Fusion draws it 1.4 times darker than what is behind, which nobody sees on dark panels.
    """
    result = palette(colours)
    result.setColor(QPalette.ColorRole.Window, QColor(colours.frame).lighter(140))
    return result


def _sheet(colours: Colours) -> str:
    """What the palette cannot set: flat handles, tabs, docks, tool buttons and table headers.

    Sizes are in ``em``, so that they grow with the font.
    """
    c = colours
    return f"""
    QLabel[tone="trouble"] {{ color: {c.trouble}; }}
    QLabel[tone="warning"] {{ color: {c.warning}; }}
    QLabel#refusal {{ background: {c.background}; border: 1px solid {c.trouble};
        border-radius: 3px; }}
    QToolTip {{ color: {c.text}; background: {c.background}; border: 1px solid {c.frame};
        padding: 0.25em; }}
    QMenu {{ menu-scrollable: 1; }} /* not further columns, off the screen */
    QMainWindow::separator {{ background: {c.panel_edge}; width: 5px; height: 5px; }}
    QMainWindow::separator:hover, QSplitter::handle:hover {{ background: {c.accent}; }}
    QSplitter::handle {{ background: {c.panel_edge}; }}
    QSplitter::handle:horizontal {{ width: 5px; }}
    QSplitter::handle:vertical {{ height: 5px; }}
    QDockWidget::title {{ background: {c.panel}; padding: 0.4em 0.5em; text-align: left; }}
    QTabBar::tab {{ background: transparent; color: {c.muted}; padding: 0.45em 0.9em;
        border: none; border-bottom: 2px solid transparent; }}
    QTabWidget#narrow QTabBar::tab {{ padding: 0.45em 0.5em; }}
    QTabBar::tab:hover {{ color: {c.text}; }}
    QTabBar::tab:selected {{ color: {c.text}; border-bottom-color: {c.accent}; }}
    QTabBar::tab:focus {{ background: {c.panel_edge}; }}
    QTabWidget::pane {{ border: none; border-top: 1px solid {c.panel_edge}; }}
    QToolBar {{ border: none; spacing: 2px; padding: 2px; }}
    QToolButton {{ border: 1px solid transparent; border-radius: 4px; padding: 0.25em; }}
    QToolButton#qt_toolbar_ext_button {{ padding: 0; border: none; }} /* or its arrow has no room */
    QToolButton:hover {{ background: {c.panel_edge}; }}
    QToolButton:pressed {{ background: {c.frame}; }}
    QToolButton:checked {{ background: {c.accent}; color: {c.accent_text}; }}
    QToolButton:focus {{ border-color: {c.accent}; }}
    QHeaderView {{ background: {c.panel}; }}
    QHeaderView::section {{ background: {c.panel}; color: {c.muted}; border: none;
        border-bottom: 1px solid {c.frame}; padding: 0.35em 3px; text-align: left; }}
    QHeaderView::section:vertical {{ padding: 0.35em 0.5em; }}
    QTableCornerButton::section {{ background: {c.panel}; border: none; }}
    QCheckBox::indicator:unchecked, QRadioButton::indicator:unchecked,
    QAbstractItemView::indicator:unchecked {{
        background: {c.background}; border: 1px solid {c.muted}; width: 11px; height: 11px; }}
    QCheckBox::indicator:unchecked, QAbstractItemView::indicator:unchecked {{
        border-radius: 3px; }}
    QRadioButton::indicator:unchecked {{ border-radius: 6px; }}
    QStatusBar::item {{ border: none; }}
    QLineEdit {{ background: {c.background}; border: 1px solid {c.frame}; border-radius: 3px;
        padding: 0.2em 0.3em; }}
    QLineEdit:focus {{ border-color: {c.accent}; }}
    QLineEdit:disabled {{ background: {c.panel}; }}
    QInputDialog > QLineEdit {{ min-width: 30em; }}
    QAbstractSpinBox {{ min-height: 1.35em; }}
    QAbstractSpinBox QLineEdit, QComboBox QLineEdit, QAbstractItemView QLineEdit {{
        border: none; padding: 0; }}
    QAbstractItemView QLineEdit#field {{ border: 1px solid {c.frame}; padding: 0.2em 0.3em; }}
    QAbstractItemView QLineEdit#field:focus {{ border-color: {c.accent}; }}
    QCommandLinkButton {{ border: 1px solid transparent; border-radius: 4px; }}
    QCommandLinkButton:hover {{ background: {c.panel_edge}; }}
    QCommandLinkButton:focus {{ border-color: {c.accent}; }}
    QDialogButtonBox {{ dialogbuttonbox-buttons-have-icons: 0; }}
    """


def use_text_size(app: QApplication, percent: int) -> None:
    """Give the application letters of so many percent of the system's size.

    Windows get their style sheet anew: beneath one, fonts do not follow.
    """
    text_size.set_scale(percent / 100)
    face = QFont(_system_font())
    face.setPointSizeF(face.pointSizeF() * percent / 100)
    if face == app.font():
        return
    app.setFont(face)
    dressed = [window for window in app.topLevelWidgets() if window.styleSheet()]
    for window in dressed:
        window.setStyleSheet("")
    for window in dressed:
        apply_to_application(window)


@cache
def _system_font() -> QFont:
    """The application's font as the system wants it."""
    return QApplication.font()
