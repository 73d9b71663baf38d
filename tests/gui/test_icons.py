"""Icons: each is there, in the theme's ink, at every scale."""

import pytest
from PySide6.QtCore import QSize
from PySide6.QtGui import QColor, QIcon

from forcelab.gui import theme
from forcelab.gui.icons import NAMES, icon


def inked(image):
    """The share of the image that is drawn on, and the colour of what is fully drawn on."""
    colours = [image.pixelColor(x, y) for x in range(image.width()) for y in range(image.height())]
    drawn = [colour for colour in colours if colour.alpha() > 0]
    full = {colour.name() for colour in drawn if colour.alpha() == 255}
    return len(drawn) / len(colours), full


@pytest.mark.parametrize("name", NAMES)
def test_every_icon_is_drawn_in_one_ink_and_leaves_its_edge_free(app, name):
    image = icon(name).pixmap(QSize(64, 64)).toImage()
    share, full = inked(image)
    assert 0.02 < share < 0.6
    assert len(full) == 1
    rim = [(i, j) for i in range(64) for j in (0, 63)]
    assert not any(
        image.pixelColor(*at).alpha() or image.pixelColor(*at[::-1]).alpha() for at in rim
    )


def test_no_two_icons_are_alike(app):
    images = {name: icon(name).pixmap(QSize(32, 32)).toImage() for name in NAMES}
    assert len({bytes(image.constBits()) for image in images.values()}) == len(NAMES)


def test_an_icon_follows_the_theme_and_its_state(app):
    drawing = icon("pause")
    try:
        for choice, colours in (("dark", theme.DARK), ("light", theme.LIGHT)):
            theme.use_theme(app, choice)
            assert inked(drawing.pixmap(QSize(32, 32)).toImage())[1] == {colours.text}
            on = drawing.pixmap(QSize(32, 32), QIcon.Mode.Normal, QIcon.State.On).toImage()
            assert inked(on)[1] == {QColor(colours.accent_text).name()}
            off = drawing.pixmap(QSize(32, 32), QIcon.Mode.Disabled).toImage()
            assert inked(off)[1] == set()  # all of it is see-through
    finally:
        theme.use_theme(app, "light")


def test_an_icon_is_as_fine_as_the_screen(app):
    picture = icon("play").pixmap(QSize(18, 18), 2.0)
    assert (picture.width(), picture.devicePixelRatio()) == (36, 2.0)


def test_a_copy_outlives_its_original(app):
    copy = QIcon(icon("loop"))
    assert inked(copy.pixmap(QSize(16, 16)).toImage())[0] > 0


def test_what_is_no_icon_is_a_mistake(app):
    with pytest.raises(KeyError):
        icon("smiley")


def test_an_icon_without_room_is_drawn_without_a_complaint(app, capfd):
    assert icon(NAMES[0]).pixmap(QSize(0, 16)).isNull()
    assert "QPainter" not in capfd.readouterr().err
