from dataclasses import fields
from itertools import combinations

import numpy as np
import pytest
from PySide6.QtCore import QByteArray, Qt
from PySide6.QtGui import QGuiApplication, QPalette
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QComboBox,
    QDialogButtonBox,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QMainWindow,
    QMenu,
    QPlainTextEdit,
    QProxyStyle,
    QSpinBox,
    QStyle,
    QTreeWidget,
)

from forcelab.gui import theme
from forcelab.gui.export_dialog import ExportDialog
from forcelab.gui.import_dialog import ImportDialog
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.actions import KeyDialog
from forcelab.gui.label_import_dialog import LabelImportDialog
from forcelab.gui.layout import Dock
from forcelab.gui.removal_dialog import Removal
from forcelab.vocabulary import COLOURS

#: Machado, Oliveira and Fernandes 2009, severity 1.0, on linear RGB.
VISIONS = {
    "normal": np.eye(3),
    "protan": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deutan": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritan": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
THEMES = pytest.mark.parametrize("colours", [theme.LIGHT, theme.DARK], ids=["light", "dark"])


def linear(colour):
    rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def contrast(first, second):
    """WCAG 2.2, section 1.4.3."""
    low, high = sorted(linear(c) @ [0.2126, 0.7152, 0.0722] for c in (first, second))
    return (high + 0.05) / (low + 0.05)


def lab(rgb):
    """CIE L*a*b* (D65) of linear RGB."""
    to_xyz = np.array(
        [
            [0.4124564, 0.3575761, 0.1804375],
            [0.2126729, 0.7151522, 0.0721750],
            [0.0193339, 0.1191920, 0.9503041],
        ]
    )
    xyz = to_xyz @ np.clip(rgb, 0, 1) / [0.95047, 1.0, 1.08883]
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.fixture
def themed(app):
    yield app
    theme.use_theme(app, "light")


@THEMES
def test_every_text_can_be_read_on_every_ground(colours):
    for ink in (colours.text, colours.muted, colours.warning, colours.trouble):
        for ground in (colours.background, colours.panel, colours.panel_edge):
            assert contrast(ink, ground) >= 4.5, (ink, ground)
    assert contrast(colours.accent_text, colours.accent) >= 4.5
    assert contrast(colours.on_unlabelled, colours.unlabelled) >= 4.5


@THEMES
def test_lines_can_be_seen_where_they_are_drawn(colours):
    for curve in colours.curves:
        assert contrast(curve, colours.background) >= 3, curve
    for line in (colours.cursor, colours.hint):
        assert contrast(line, colours.background) >= 3, line
        assert contrast(line, colours.unlabelled) >= 3, line
    assert contrast(colours.accent, colours.panel) >= 3


@THEMES
@pytest.mark.parametrize("vision", VISIONS)
def test_curves_are_told_apart_by_every_kind_of_colour_vision(colours, vision):
    appearances = [lab(VISIONS[vision] @ linear(curve)) for curve in colours.curves]
    assert len(appearances) == 8
    # Okabe and Ito's own eight keep 17.
    assert min(np.linalg.norm(a - b) for a, b in combinations(appearances, 2)) >= 24


@THEMES
def test_the_darker_actions_stand_out_from_unlabelled_time(colours):
    # In the dark theme, too: black and blue are actions' colours, and no dark ground shows both.
    for colour in ("#000000", "#0072b2"):
        assert colour in COLOURS
        assert contrast(colour, colours.unlabelled) >= 3
    assert contrast(colours.unlabelled, theme.DARK.panel) >= 7


@THEMES
def test_every_colour_is_written_alike(colours):
    for field in fields(colours):
        value = getattr(colours, field.name)
        for colour in value if isinstance(value, tuple) else (value,):
            assert len(colour) == 7, field.name
            linear(colour)


@THEMES
def test_the_palette_names_every_role_in_every_group(colours):
    created = theme.palette(colours)
    for group in ("Active", "Inactive", "Disabled"):
        for role in QPalette.ColorRole:
            if role not in (QPalette.ColorRole.NoRole, QPalette.ColorRole.NColorRoles):
                assert created.isBrushSet(QPalette.ColorGroup[group], role), (group, role)


@THEMES
def test_the_palettes_texts_can_be_read_and_what_is_disabled_looks_so(colours):
    created, role, group = theme.palette(colours), QPalette.ColorRole, QPalette.ColorGroup
    pairs = [
        (role.WindowText, role.Window),
        (role.Text, role.Base),
        (role.Text, role.AlternateBase),
        (role.PlaceholderText, role.Base),
        (role.ButtonText, role.Button),
        (role.HighlightedText, role.Highlight),
        (role.ToolTipText, role.ToolTipBase),
    ]
    for ink, ground in pairs:
        here = contrast(created.color(group.Active, ink).name(), created.color(ground).name())
        assert here >= 4.5, (ink, ground)
    for ink, ground in pairs[:2] + pairs[4:5]:
        dimmed = created.color(group.Disabled, ink).name()
        assert 2 <= contrast(dimmed, created.color(group.Disabled, ground).name()) < 4.5


class ButtonsWithIcons(QProxyStyle):
    """As the platform has it under X: dark pictures, on whatever ground."""

    def styleHint(self, hint, option=None, widget=None, data=None):  # noqa: N802
        wanted = hint == QStyle.StyleHint.SH_DialogButtonBox_ButtonsHaveIcons
        return 1 if wanted else super().styleHint(hint, option, widget, data)


@pytest.mark.parametrize(
    "opened",
    [
        lambda document, parent: ExportDialog(document, Jobs(), (), parent),
        lambda document, parent: ImportDialog(document, Jobs(), parent),
        lambda document, parent: LabelImportDialog(document, Jobs(), parent),
        lambda document, parent: KeyDialog(document.vocabulary, "grab", parent),
        lambda _, parent: Removal("Remove", "This goes.", "", parent),
    ],
    ids=["export", "import", "label import", "key", "removal"],
)
def test_buttons_of_dialogs_have_no_icons_of_the_platform(themed, document, opened):
    window = QMainWindow()
    try:
        themed.setStyle(ButtonsWithIcons("Fusion"))
        theme.apply_to_application(window)
        alone = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        assert not alone.buttons()[0].icon().isNull()
        dialog = opened(document, window)
        (box,) = dialog.findChildren(QDialogButtonBox)
        assert all(button.icon().isNull() for button in box.buttons())
    finally:
        themed.setStyle("Fusion")


def test_a_theme_is_put_on_and_told(themed):
    messages = []
    theme.themes().changed.connect(lambda: messages.append(theme.colours()))
    theme.use_theme(themed, "dark")
    label = QLabel()
    assert messages == [theme.DARK]
    assert label.palette().color(QPalette.ColorRole.Window).name() == theme.DARK.panel
    theme.use_theme(themed, "light")
    assert messages[1:] == [theme.LIGHT]
    assert themed.palette().color(QPalette.ColorRole.WindowText).name() == theme.LIGHT.text
    theme.themes().changed.disconnect()
    assert themed.style().name() == "fusion"


def test_a_menu_of_very_many_entries_scrolls_in_one_column(themed):
    """Not: covers the screen with columns, the last of which lie beside it."""
    theme.use_theme(themed, "light")
    menu = QMenu()
    theme.apply_to_application(menu)
    for i in range(200):
        menu.addAction(f"action {i}")
    menu.show()
    assert len({menu.actionGeometry(entry).left() for entry in menu.actions()}) == 1
    menu.close()


def test_the_system_is_followed_while_that_is_the_choice(themed, monkeypatch):
    def system(scheme):
        monkeypatch.setattr(theme, "_system", lambda: scheme)
        QGuiApplication.styleHints().colorSchemeChanged.emit(scheme)

    theme.use_theme(themed, "system")
    system(Qt.ColorScheme.Dark)
    assert theme.colours() is theme.DARK
    assert themed.palette().color(QPalette.ColorRole.Base).name() == theme.DARK.background
    system(Qt.ColorScheme.Light)
    assert theme.colours() is theme.LIGHT
    theme.use_theme(themed, "dark")
    system(Qt.ColorScheme.Unknown)
    assert theme.colours() is theme.DARK
    theme.use_theme(themed, "system")
    assert theme.colours() is theme.LIGHT


@pytest.mark.parametrize("created", [QSpinBox, QComboBox, QListWidget, QTreeWidget, QPlainTextEdit])
@pytest.mark.parametrize("choice", ["light", "dark"])
def test_a_box_to_type_or_choose_in_has_a_frame_that_is_seen(themed, choice, created):
    theme.use_theme(themed, choice)
    box = created()
    box.resize(120, 30)
    picture = box.grab().toImage()
    ground = theme.colours().panel
    edge = (picture.pixelColor(60, y).name() for y in range(3))
    assert max(contrast(colour, ground) for colour in edge) >= 1.5


@pytest.mark.parametrize("state", [Qt.CheckState.Unchecked, Qt.CheckState.Checked])
@pytest.mark.parametrize("choice", ["light", "dark"])
def test_what_can_be_ticked_in_a_list_is_seen(themed, choice, state):
    theme.use_theme(themed, choice)
    rows = QListWidget()
    theme.apply_to_application(rows)
    rows.resize(120, 40)
    row = QListWidgetItem(rows)
    row.setCheckState(state)
    picture, box = rows.grab().toImage(), rows.visualItemRect(row)
    inner = [picture.pixelColor(x, box.center().y() + 1).name() for x in range(4, 20)]
    assert max(contrast(colour, theme.colours().background) for colour in inner) >= 1.5


@pytest.mark.parametrize("choice", ["light", "dark"])
@pytest.mark.parametrize("name", ["close", "float"])
def test_the_buttons_of_the_lists_are_seen_and_follow_the_theme(themed, choice, name):
    theme.use_theme(themed, "light" if choice == "dark" else "dark")
    window, dock = QMainWindow(), Dock("Actions")
    window.addDockWidget(Qt.DockWidgetArea.LeftDockWidgetArea, dock)
    theme.apply_to_application(window)
    window.show()
    for floating in (False, True, False):
        dock.setFloating(floating)
        theme.use_theme(themed, choice)
        theme.apply_to_application(window)
        button = dock.findChild(QAbstractButton, f"qt_dockwidget_{name}button")
        picture = button.grab().toImage()
        places = [(x, y) for x in range(picture.width()) for y in range(picture.height())]
        inks = {picture.pixelColor(x, y).name() for x, y in places}
        assert max(contrast(ink, theme.colours().panel) for ink in inks) >= 3
    window.close()


@pytest.mark.parametrize("name", ["close", "float"])
def test_the_buttons_of_the_lists_look_the_same_at_the_next_start(themed, name):
    pictures, layout = [], QByteArray()
    for _ in range(2):
        window, dock = QMainWindow(), Dock("Actions")
        dock.setObjectName("actions")
        window.addDockWidget(Qt.DockWidgetArea.LeftDockWidgetArea, dock)
        theme.apply_to_application(window)
        if not layout.isEmpty():
            assert window.restoreState(layout)
        window.show()
        QApplication.processEvents()
        button = dock.findChild(QAbstractButton, f"qt_dockwidget_{name}button")
        pictures.append(button.grab().toImage())
        layout = window.saveState()
        window.close()
    assert pictures[0] == pictures[1]
