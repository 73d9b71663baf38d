"""What README and guide show is what happens, and what they link to exists."""

import io
import re
from contextlib import redirect_stderr, redirect_stdout
from itertools import chain
from pathlib import Path
from shlex import split

import pytest
from factories import perform_grips
from make_guide import (
    CAPTURE,
    DOCUMENTS,
    FIGURES,
    GUIDE,
    OTHERS,
    WINDOWS,
    dark,
    prepare,
    run_blocks,
    run_in,
)

from forcelab.cli import main
from forcelab.errors import InputError
from forcelab.guide import CONTENTS, Page, anchors, plain, read_page, read_pages, search

TEXTS = {path: path.read_text("utf-8") for path in DOCUMENTS}
NAMES = [path.stem for path in DOCUMENTS]


def mask_numbers(text):
    """Text without its numbers, which differ a little between processors, and without columns."""
    return re.sub(r"[ \-─]+", " ", re.sub(r"\d+(\.\d+)?(e-?\d+)?", "#", text))


def run_command(command):
    """What a line of the shell prints; its forcelab runs here, where all is loaded already."""
    named = re.fullmatch(r"forcelab ([^|&]*)(?:(\||&&|\|&) (.*))?", command, re.S)
    if named is None:
        return run_in(Path.cwd(), "bash", "-c", command)
    words, joint, rest = named.groups()
    out, err = io.StringIO(newline=None), io.StringIO(newline=None)
    with redirect_stdout(out), redirect_stderr(out if joint == "|&" else err):
        status = main(list(chain.from_iterable(map(expand, split(words.replace("\\\n", " "))))))
    if rest is None or joint == "&&":
        printed = err.getvalue() + out.getvalue()
        return printed + (run_in(Path.cwd(), "bash", "-c", rest) if rest and not status else "")
    Path("printed").write_text(out.getvalue(), "utf-8")
    return err.getvalue() + run_in(Path.cwd(), "bash", "-c", f"cat printed | {rest}")


def expand(word):
    return sorted(map(str, Path().glob(word))) if "*" in word else [word]


def run_script(script):
    with redirect_stdout(io.StringIO()) as out:
        exec(script, {"__name__": "__main__"})
    return out.getvalue()


def test_a_command_runs_behind_one_that_was_done_and_never_behind_one_that_failed():
    assert run_command("forcelab actions hold && echo done").endswith("done\n")
    assert run_command("forcelab list missing.forcelab && echo done").count("\n") == 1


@pytest.fixture(scope="module")
def renewed(tmp_path_factory):
    """All documents with their output made anew, in one folder, and what their scripts print."""
    folder = tmp_path_factory.mktemp("guide")
    prepare(folder)
    with pytest.MonkeyPatch.context() as patched:
        # Commands start no processes of their own: the tests share the processors already.
        patched.setenv("LOKY_MAX_CPU_COUNT", "1")
        # What a script registers is forgotten.
        patched.setattr("forcelab.recognition.plugins._named", {"classifier": {}, "features": {}})
        patched.setattr("forcelab.simulation.generate.perform_job", perform_grips)
        patched.chdir(folder)
        yield (
            folder,
            {path: run_blocks(path, run_command, run_script, slow=False) for path in DOCUMENTS},
        )


@pytest.mark.parametrize("path", DOCUMENTS, ids=NAMES)
def test_every_command_prints_what_the_page_shows(renewed, path):
    assert mask_numbers(renewed[1][path][0]) == mask_numbers(TEXTS[path])


def test_scripts_score_well_and_figures_are_drawn(renewed):
    folder, documents = renewed
    assert (folder / "pairs.png").read_bytes().startswith(b"\x89PNG")
    printed = [text for _, scripts in documents.values() for text in scripts]
    (reviewed,) = [text for text in printed if text.startswith("F1@50 ")]
    assert float(re.match(r"F1@50 ([.0-9]+), worst foam-0[1-6]\n", reviewed)[1]) > 0.5
    (shown,) = [text for text in printed if text.startswith("foam-06: ")]
    assert float(re.fullmatch(r"foam-06: \(1097, 64\), (0\.\d\d)\n", shown)[1]) > 0.85


def links(text):
    return re.findall(r"\]\(([^)\s]*)\)", re.sub(r"```.*?```", "", text, flags=re.S))


@pytest.mark.parametrize("path", DOCUMENTS, ids=NAMES)
def test_every_link_leads_to_a_file_and_a_heading_that_exist(path):
    for link in links(TEXTS[path]):
        if link.startswith("https://"):
            continue
        name, _, anchor = link.partition("#")
        target = path.parent / name if name else path
        assert target.exists(), link
        if anchor:
            sections = Page(target.stem, target.read_text("utf-8")).sections
            assert anchor in [section.anchor for section in sections], link


def test_every_picture_is_shown_and_is_one_that_is_made():
    shown = {(path.parent / link).resolve() for path, text in TEXTS.items() for link in links(text)}
    drawn = {*WINDOWS, CAPTURE}
    made = drawn | set(map(dark, drawn)) | set(FIGURES) | OTHERS.keys()
    lying = set(GUIDE.glob("pictures/*"))
    assert {path.name for path in lying} <= made
    assert lying - shown == {path for path in lying if path.stem.endswith("-dark")}
    for path in (GUIDE / "pictures").glob("*-dark.png"):
        assert path.with_name(path.name.replace("-dark", "")).exists()
    text = "\n".join(TEXTS.values())
    for name in FIGURES:
        assert re.search(rf"^\$ .*--(figure|confusion) {name}", text, re.M), name


@pytest.mark.parametrize("path", DOCUMENTS, ids=NAMES)
def test_a_page_shows_no_picture_twice_and_describes_each_in_plain_words(path):
    pictures = re.findall(r"!\[([^\]]*)\]\(([^)]*)\)", TEXTS[path])
    assert len({name for _, name in pictures}) == len(pictures)
    assert all(text and plain(text) == text for text, _ in pictures)


def test_the_contents_name_the_pages_that_exist():
    assert {path.stem for path in GUIDE.glob("*.md")} == set(CONTENTS)
    assert [page.name for page in read_pages()] == NAMES[1:]
    assert all(page.title != page.name for page in read_pages())


def test_headings_are_named_as_github_names_them():
    titles = ["Files in and out", "What (it) is: a `run`?", "Setup", "Setup"]
    named = ["files-in-and-out", "what-it-is-a-run", "setup", "setup-1"]
    assert anchors(map(plain, titles)) == named
    page = Page(
        "python", "# From Python\nOne.\n\n```sh\n# no heading\n```\n\n## `help` of [it](a.md)\n"
    )
    assert [(s.level, s.title, s.anchor) for s in page.sections] == [
        (1, "From Python", "from-python"),
        (2, "help of it", "help-of-it"),
    ]
    assert page.title == "From Python"
    assert "# no heading" in page.sections[0].lines


def found(query, pages=None):
    return [f"{m.section.page}#{m.section.anchor}" for m in search(pages or read_pages(), query)]


@pytest.mark.parametrize(
    ("query", "place"),
    [
        ("second coder", "questions#how-do-two-coders-share-a-project"),
        ("my labels are gone", "questions#my-labels-are-gone"),
        ("video is late", "questions#my-video-is-late"),
        ("undo", "label#undo"),
        ("unlabelled", "questions#it-says-unlabelled"),
        ("accuracy", "recognise#what-the-scores-are"),
        ("What is a run?", "questions#what-is-a-run"),
    ],
)
def test_a_search_leads_to_the_section_that_answers_it(query, place):
    assert place in found(query)[:3]
    # Whole paragraphs without marks: links too, which go on in the next line.
    assert not any(re.search(r"\*\*|\]\(|\[\w+ \w", m.excerpt) for m in search(read_pages(), query))


def test_all_words_come_before_most_and_headings_before_text():
    pages = (
        Page(
            "label",
            "# Label\nA *video* that is late.\n\n## Snap\n| key | of |\n|---|---|\n| F7 | video |",
        ),
        Page("questions", "# Questions\n\n## My video is late\nSee [the\nclock](label.md).\n"),
    )
    order = ["questions#my-video-is-late", "label#label", "label#snap"]
    assert found("the Videos are LATE", pages) == order
    assert found("video tea", pages) == ["questions#my-video-is-late", "label#label", "label#snap"]
    assert search(pages, "f7")[0].excerpt == "F7 – video"
    assert search(pages, "video")[0].excerpt == "See the clock."
    assert search(pages, "video")[1].excerpt == "A video that is late."
    assert search(pages, "ate") == search(pages, "tea") == search(pages, " ") == []


def test_an_excerpt_shows_the_word_of_a_long_line():
    page = Page(
        "label", f"# Label\n{'Much before it, ' * 20}the needle is here, {'much after it, ' * 20}"
    )
    (match,) = search([page], "needle")
    assert "needle" in match.excerpt
    assert match.excerpt.startswith("…")
    assert match.excerpt.endswith("…")
    assert len(match.excerpt) <= 111


def test_an_unknown_page_is_refused_with_the_nearest_name():
    with pytest.raises(InputError, match="no page 'lable'; did you mean 'label'"):
        read_page("lable")
