"""What a notebook shows of projects, demonstrations, runs and scores, and what plot() draws."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from factories import (
    BAYES_SETTINGS,
    FAST_OPTIONS,
    FOAM_SELECTION,
    make_labelled_project,
    sine_demonstration,
)

import forcelab
from forcelab.cli import main
from forcelab.gui.figures import text
from forcelab.vocabulary import Action, Vocabulary


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A project whose actions have colours of their own, with a run in it."""
    path = make_labelled_project(tmp_path_factory.mktemp("notebook") / "foam.forcelab")
    with forcelab.Project.open(path) as project:
        names = [action.name for action in project.actions.vocabulary("foam")]
        colours = [f"#{number}04060" for number in range(1, 1 + len(names))]
        actions = map(Action, names, colours, "abcdef")
        vocabulary = Vocabulary(tuple(actions))
        project.actions.set_vocabulary("foam", vocabulary)
        forcelab.finish(forcelab.evaluate_tasks_job(project, BAYES_SETTINGS, FOAM_SELECTION))
    return path


@pytest.fixture
def project(path):
    with forcelab.Project.open(path) as project:
        yield project


def cells(html):
    """The texts of each row of a table."""
    rows = re.findall("<tr>(.*?)</tr>", html)
    return [re.findall("<t[hd]>(.*?)</t[hd]>", row) for row in rows]


def svg_in(html):
    """The root of the picture in some HTML, which must be well-formed."""
    return ElementTree.fromstring(html[html.index("<svg") : html.index("</svg>") + 6])


def test_a_run_and_its_evaluation_are_drawn_as_the_command_line_draws_them(path, tmp_path):
    file = tmp_path / "pairs.svg"
    settings = ["--task", "foam", "--author", "Ada", "--stride", "1"]
    assert main(["evaluate", str(path), *FAST_OPTIONS, *settings, "--figure", str(file)]) in (
        0,
        None,
    )
    with forcelab.Project.open(path) as project:
        run = forcelab.latest_run(project)
        job = forcelab.evaluate_tasks_job(project, run.settings, FOAM_SELECTION)
        evaluated = forcelab.finish(job)
    evaluation = evaluated.evaluations[0][1]
    assert evaluated._repr_html_() == evaluation._repr_html_()
    drawn = file.read_text("utf-8")
    assert "#104060" in drawn  # the project's colours
    assert run.plot()._repr_svg_() in drawn
    assert evaluation.plot()._repr_svg_() in drawn
    run.plot().save(str(tmp_path / "again.svg"))
    assert (tmp_path / "again.svg").read_text("utf-8") == drawn


def test_a_run_shows_its_scores_and_its_pairs(project):
    run = forcelab.load_run(project, 1)
    html = run._repr_html_()
    head, *rows = cells(html)
    assert head == ["demonstration", "accuracy %", "coverage %", "edit %", "F1@50 %"]
    assert [row[0] for row in rows][-2:] == ["pooled", "95 % interval"]
    pooled = run.scores["filtered"]["pooled"]
    assert rows[-2][1] == f"{100 * pooled['accuracy']:.1f}"
    assert svg_in(html).tag.endswith("svg")


def test_scores_and_a_project_are_tables(project):
    human = (forcelab.Segment(0.0, 1.0, "grab"),)
    scores = forcelab.score_tracks(human, human)
    assert ["accuracy", "100.0"] in cells(scores._repr_html_())
    head, row = cells(project._repr_html_())
    assert (head[0], row[0], row[1], row[3]) == ("task", "foam", "4", "Ada (3)")
    project.close()
    assert "closed" in project._repr_html_()


def test_a_demonstration_shows_its_channels_and_the_tracks_that_one_gives(project):
    id_ = project.demonstrations.infos()[0].id
    demonstration, tracks = project.demonstrations.load(id_), project.tracks.of(id_)
    assert "Ada" not in demonstration._repr_html_()
    texts = [
        t.text.strip() for t in svg_in(demonstration.plot(*tracks)._repr_svg_()).iter() if t.text
    ]
    assert {"Ada", "time (s)", *(track for track in tracks[0].actions)} <= set(texts)
    assert all(f"{c.name} ({c.unit})" in texts for c in demonstration.channels)


def test_a_curve_is_broken_where_nothing_was_measured():
    whole = sine_demonstration("01", "foam")
    signals = np.array(whole.signals)
    signals[400:600, 0] = np.nan
    parts = forcelab.Demonstration("01", "foam", whole.times, signals, whole.channels)

    def lines(demonstration):
        svg = demonstration.plot()._repr_svg_()
        return sum(points.count(",") > 2 for points in re.findall(r'points="([^"]*)"', svg))

    assert lines(parts) == lines(whole) + 1


def test_names_cannot_become_markup():
    name = "<script>alert('x')</script>&"
    made = forcelab.Demonstration.from_frame(
        {"t": [0.0, 0.1, 0.2], name: [1.0, 2.0, 3.0]}, name, task="<b>"
    )
    html = made._repr_html_() + made.plot(forcelab.Track(name))._repr_svg_()
    assert "<script" not in html
    assert "<b>" not in html
    svg_in(html)


def test_where_nothing_can_be_drawn_the_table_stays(project, monkeypatch):
    def refuse():
        raise forcelab.InputError("Qt needs <libEGL>; install it.")

    monkeypatch.setattr(text, "ensure_application", refuse)
    html = forcelab.latest_run(project)._repr_html_()
    assert "pooled" in html
    assert "Qt needs &lt;libEGL&gt;; install it." in html
