"""The example of each public name does what it shows.

In them ``project`` is an open project, ``labelled`` what Ada labelled in it, ``settings`` those of
a quick recogniser, ``run`` the latest evaluation; there is a folder to write into.
"""

import doctest

import numpy as np
import pytest
from factories import make_labelled_project, perform_grips

import forcelab
from forcelab.simulation import generate

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
NAMES = [name for name in forcelab.__all__ if name != "__version__"]


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """What the examples use: made once, in the folder in which they run."""
    folder = tmp_path_factory.mktemp("examples")
    make_labelled_project(folder / "lab.forcelab")
    (folder / "pull.csv").write_text("time,fx (N),label\n0.00,0.5,grab\n0.01,0.7,grab\n0.02,0.9,\n")
    (folder / "foam 04.labels.csv").write_text("start,end,action\n0.5,2.0,grab\n")
    settings = forcelab.preset("paper").replace(classifier="naive-bayes", max_scale=64, stride=5)
    with forcelab.Project.open(folder / "lab.forcelab") as project:
        for info in project.demonstrations.infos():
            seen = project.tracks.get(info.id, "Ada").segments[:4]
            project.tracks.edit(info.id, "Bo", (), seen, "made") if seen else None
        selection = forcelab.DataSelection(tasks=("foam",), author="Ada")
        forcelab.finish(forcelab.evaluate_tasks_job(project, settings, selection))
        yield (
            folder,
            {
                "forcelab": forcelab,
                "np": np,
                "project": project,
                "labelled": forcelab.load_dataset(project, ["foam"], "Ada").labelled,
                "settings": settings,
                "run": forcelab.latest_run(project),
            },
        )


@pytest.mark.parametrize("name", NAMES)
def test_each_public_name_has_an_example_that_does_what_it_shows(name, shared, monkeypatch):
    folder, names = shared
    monkeypatch.chdir(folder)
    monkeypatch.setattr(generate, "perform_job", perform_grips)  # whose mechanics take seconds
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner(optionflags=FLAGS)
    example = parser.get_doctest(getattr(forcelab, name).__doc__, dict(names), name, None, 0)
    assert example.examples
    output = []
    runner.run(example, out=output.append)
    assert not runner.failures, "".join(output)
