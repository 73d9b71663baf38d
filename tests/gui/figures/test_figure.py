import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QRectF, QSizeF
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtSvg import QSvgRenderer
from window_helpers import pixels

from forcelab.errors import InputError
from forcelab.gui.figures.clusters import ClusterFigure
from forcelab.gui.figures.confusion import ConfusionMatrix
from forcelab.gui.figures.figure import LIGHT, Figure
from forcelab.gui.figures.pairs import Pair, TimelinePairs
from forcelab.gui.figures.tradeoff import Tradeoff
from forcelab.gui.figures.wavelets import WaveletFigure, WaveletView
from forcelab.labels import Segment
from forcelab.measure.rows import Row, Table, with_front
from forcelab.vocabulary import Vocabulary

HOSTILE = "a name that is far too long & <never ends> \x00\ud800\n" * 8


def timelines(name="stylus 1", action="grab", title="Stylus"):
    human = (Segment(0.5, 2.0, action), Segment(2.0, 3.0, "hold"))
    predicted = (Segment(0.6, 1.8, action), Segment(1.9, 1.91, "hold"))
    pairs = tuple(Pair(name, human, predicted, 0.0, 4.0, f"{name} %") for _ in range(3))
    vocabulary = Vocabulary().with_actions(*(f"filler {i}" for i in range(8)), action, "hold")
    return TimelinePairs(title, pairs, vocabulary)


def confusion(name="grab", title="Foam"):
    return ConfusionMatrix(
        title, (name, "hold", "release"), np.array([[9, 1, 0, 0], [0] * 4, [3, 0, 3, 3]])
    )


def wavelets(name="p = 5", title="Wavelets"):
    t = np.linspace(-4, 4, 101)
    times = np.linspace(0, 2, 201)
    magnitudes = np.outer(np.exp(-(np.linspace(-3, 3, 20) ** 2)), np.sin(times) ** 2)
    hertz = np.geomspace(1, 50, 20)
    view = WaveletView(name, t, np.exp(5j * t - t**2 / 2), hertz, magnitudes)
    return WaveletFigure(title, (view, view), times, np.sin(20 * times), (3.0, 10.0))


def clusters(name="Haar", title="Clusters"):
    times = np.linspace(0, 5, 101)
    codes = (np.arange(101) // 30).astype(np.int64)
    return ClusterFigure(title, times, np.sin(times), ((name, codes), ("DOG", codes)))


def tradeoff(name="Radau", title="Trade-off"):
    rows = [
        Row(solver, f"{solver}, {step} ms", name, name, step * 1e-3, 1 / step, 0.1, 1)
        for solver in (name, "explicit")
        for step in (1, 10)
    ]
    rows.append(Row("implicit", name, name, name, refusal="It takes too many steps."))
    return Tradeoff(Table(title, "error", "seconds", with_front(rows)))


FIGURES = [timelines, confusion, wavelets, clusters, tradeoff]


def rendered_svg(path, width, height):
    renderer = QSvgRenderer(str(path))
    assert renderer.isValid()
    image = QImage(width, height, QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(QColor("magenta"))
    painter = QPainter(image)
    renderer.render(painter, QRectF(0, 0, width, height))
    painter.end()
    return pixels(image)


def worst(first, second):
    """Largest difference of two pictures after 8 x 8 blurring, which forgives antialiasing."""
    height, width = (8 * int(n // 8) for n in np.minimum(first.shape, second.shape)[:2])
    blocks = (height // 8, 8, width // 8, 8, 3)
    first, second = (p[:height, :width].reshape(blocks).mean(axis=(1, 3)) for p in (first, second))
    return np.abs(first - second).max()


@pytest.mark.parametrize("make", FIGURES)
def test_the_same_figure_comes_out_as_png_svg_and_pdf(make, tmp_path):
    figure = make()
    for kind in ("png", "svg", "pdf"):
        figure.save(tmp_path / f"f.{kind}")
    png = pixels(QImage(str(tmp_path / "f.png")))
    assert np.array_equal(png, pixels(figure.image()))
    assert worst(png, rendered_svg(tmp_path / "f.svg", png.shape[1], png.shape[0])) < 10
    assert worst(png, pixels(make(title="Another title").image())) > 60  # the measure can tell
    # A PDF has one page as large as the figure, and brings its fonts.
    content = (tmp_path / "f.pdf").read_bytes()
    [box] = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", content)
    wide, high = (float(side) / 0.75 for side in box)
    assert 0 <= wide - figure.size.width() < 4
    assert 0 <= high - figure.size.height() < 4
    assert b"/FontFile2" in content
    if shutil.which("pdftoppm") is None:
        pytest.skip("needs pdftoppm to draw a PDF")
    command = ["pdftoppm", "-r", "192", "-png", "-singlefile", "f.pdf", "page"]
    subprocess.run(command, cwd=tmp_path, check=True)
    page = pixels(QImage(str(tmp_path / "page.png")))
    assert page.shape == png.shape
    assert worst(page, png) < 40


@pytest.mark.parametrize("make", FIGURES)
@pytest.mark.parametrize("name", ["a", HOSTILE])
def test_nothing_is_drawn_in_the_margins_however_long_the_names(make, name):
    picture = pixels(make(name, title=name).image(1.0))
    inner = np.zeros(picture.shape[:2], dtype=bool)
    inner[12:-12, 12:-12] = True
    assert (picture[~inner] == 255).all()
    assert (picture[inner] != 255).any()


@pytest.mark.parametrize("make", FIGURES)
def test_an_svg_is_well_formed_and_its_text_stays_text(make, tmp_path):
    make("grab & <hold>\x00\x0b").save(tmp_path / "f.svg")
    root = ET.parse(tmp_path / "f.svg").getroot()
    texts = ["".join(node.itertext()).strip() for node in root.findall(".//{*}text")]
    assert "grab & <hold>" in texts
    faces = {node.get("font-family", "") for node in root.findall(".//{*}text")}
    assert all("sans-serif" in face for face in faces)


def test_a_theme_changes_the_background_and_the_text():
    dark = replace(LIGHT, background="#101418", text="#f0f0f0")
    picture = pixels(replace(timelines(), theme=dark).image(1.0))
    assert tuple(picture[2, 2]) == (0x10, 0x14, 0x18)
    title = picture[20:45, 20:90]
    assert title.max() >= 0xE0


def test_a_png_has_two_pixels_a_pixel_and_says_how_large_it_is(tmp_path):
    figure = timelines()
    figure.save(tmp_path / "f.PNG")
    image = QImage(str(tmp_path / "f.PNG"))
    assert image.width() == 2 * figure.size.width()
    assert image.dotsPerMeterX() * 0.0254 == pytest.approx(192, rel=0.01)


class Broken(Figure):
    title, theme = "broken", LIGHT
    size = QSizeF(40, 40)

    def paint(self, painter):
        painter.fillRect(QRectF(0, 0, 1 / 0, 1), QColor("red"))


class Long(Broken):
    size = QSizeF(40, 40_000)

    def paint(self, painter):
        painter.fillRect(QRectF(0, 39_000, 40, 1000), QColor("red"))


def test_a_figure_longer_than_qt_can_hold_is_drawn_smaller_but_whole():
    picture = pixels(Long().image())
    assert picture.shape[0] <= 32_767
    assert tuple(picture[-1, 10]) == (255, 0, 0)
    assert tuple(picture[0, 10]) == (255, 255, 255)


@pytest.mark.parametrize("name", ["figure.jpg", "figure", "figure.svg.gz"])
def test_another_suffix_is_refused_with_one_sentence(name, tmp_path):
    with pytest.raises(InputError, match=r"\.svg, \.pdf or \.png") as caught:
        timelines().save(tmp_path / name)
    assert name in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".svg", ".pdf", ".png"])
def test_a_folder_that_is_missing_or_no_folder_is_told_in_one_sentence(suffix, tmp_path):
    (tmp_path / "file").write_text("mine")
    for folder in ("missing", "file"):
        path = tmp_path / folder / f"figure{suffix}"
        with pytest.raises(InputError, match="cannot be written") as caught:
            timelines().save(path)
        assert str(path) in str(caught.value)
    assert (tmp_path / "file").read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("suffix", [".svg", ".pdf", ".png"])
def test_what_was_there_before_is_untouched_when_drawing_fails(suffix, tmp_path):
    path = tmp_path / f"figure{suffix}"
    path.write_text("mine")
    with pytest.raises(ZeroDivisionError):
        Broken().save(path)
    assert path.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [path]


def test_what_was_there_before_is_untouched_when_the_disk_is_full(tmp_path, monkeypatch):
    path = tmp_path / "figure.svg"
    path.write_text("mine")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="No space left"):
        timelines().save(path)
    assert path.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [path]


DRAW = """
from forcelab.errors import InputError
import numpy as np
from pathlib import Path
from forcelab.gui.figures.confusion import ConfusionMatrix
try:
    ConfusionMatrix("t", ("a",), np.array([[1, 0]])).save(Path("f.png"))
except InputError as error:
    print(error)
"""


def run_elsewhere(folder, **changes):
    """Draw in a process of its own with another environment."""
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    environment = {k: v for k, v in os.environ.items() if k not in hidden} | changes
    command = [sys.executable, "-c", DRAW]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=True
    ).stdout


def test_figures_are_drawn_without_a_display(tmp_path):
    assert run_elsewhere(tmp_path) == ""
    assert (tmp_path / "f.png").stat().st_size > 1000


def test_a_window_can_follow_a_figure_and_a_figure_uses_the_windows_application():
    script = """
from PySide6.QtWidgets import QApplication, QWidget
from forcelab.gui.figures import text
{first}
application = text.ensure_application()
assert application is QApplication.instance() is text.ensure_application()
QWidget().show()
"""
    for first in ("", "mine = QApplication([])"):
        done = subprocess.run(
            [sys.executable, "-c", script.format(first=first)],
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="fontconfig finds fonts on Linux")
def test_a_system_without_fonts_is_told_which_package_has_some(tmp_path):
    (tmp_path / "fonts.conf").write_text("<fontconfig><dir>/nowhere</dir></fontconfig>")
    output = run_elsewhere(tmp_path, FONTCONFIG_FILE=str(tmp_path / "fonts.conf"))
    assert "fonts-dejavu-core" in output
    assert not (tmp_path / "f.png").exists()
