"""The guide from the command line: its pages as HTML, and as text where there is no display."""

import json
from html.parser import HTMLParser

from forcelab.gui.figures.text import ensure_application
from forcelab.gui.guide_html import page_html
from forcelab.guide import CONTENTS, Page, read_page

EMPTY = {"meta", "link", "img", "br", "hr", "source"}
BLOCKS = {"ul", "ol", "table", "pre", "div", "p", "h2"}


class Checker(HTMLParser):
    """Elements that are closed in order and nested as HTML allows; ids and links."""

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.links, self.words = [], [], [], ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        assert not (tag in BLOCKS and "p" in self.open), self.getpos()
        in_list = bool(self.open) and self.open[-1] in ("ul", "ol")
        assert in_list == (tag == "li"), self.getpos()
        if tag not in EMPTY:
            self.open.append(tag)
        values = dict(attributes)
        self.ids += [values["id"]] if "id" in values else []
        self.links += [values[name] for name in ("href", "src", "srcset") if name in values]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, self.getpos()

    def handle_data(self, data):
        self.words += data


def test_the_guide_is_written_as_pages_whose_links_and_pictures_exist(forcelab, tmp_path):
    result = forcelab("guide", "--out", tmp_path / "guide")
    assert (result.status, result.out) == (0, f"{tmp_path / 'guide' / 'index.html'}\n")
    files = {path.name: path for path in (tmp_path / "guide").glob("*.html")}
    assert files.keys() <= {f"{name}.html" for name in CONTENTS}
    pages = {name: Checker(path.read_text("utf-8")) for name, path in files.items()}
    for name, page in pages.items():
        assert len(page.ids) == len(set(page.ids))
        assert read_page(name.removesuffix(".html")).title in page.words
        for link in page.links:
            target, _, anchor = link.partition("#")
            if not target.startswith("https://"):
                assert (tmp_path / "guide" / target).exists(), link
                assert not anchor or anchor in pages[target or name].ids, link


MARKDOWN = """# A & B
Some *it* and **bold** `<code>`, [a `link`](label.md#keys), [web](https://example.org?a=1&b=2).

* one
  1. nested

  more
* two

| a | b |
|---|---|
| x | `y` |
| z |  |

```console
$ forcelab <x>
 "out"
```

```console
$ second
```

![the "window"](pictures/window.png)
"""


def test_what_a_page_holds_becomes_html():
    ensure_application()
    page = Page("python", MARKDOWN)
    text, pictures = page_html(page, (page,))
    Checker(text)
    body = text.partition("<main>")[2].partition('<p class="steps">')[0]
    for part in (
        '<h1 id="a--b">A &amp; B</h1>',
        "<em>it</em> and <strong>bold</strong> <code>&lt;code&gt;</code>",
        '<a href="label.html#keys">a <code>link</code></a>',
        '<a href="https://example.org?a=1&amp;b=2">web</a>',
        "<thead><tr><th>a</th><th>b</th></tr></thead>",
        "<tr><td>x</td><td><code>y</code></td></tr>\n<tr><td>z</td><td></td></tr>",
        '<pre><code>$ forcelab &lt;x&gt;\n "out"</code></pre>\n<pre><code>$ second</code></pre>',
        'media="(prefers-color-scheme: dark)"><img src="pictures/window.png" '
        'alt="the &quot;window&quot;" width="1280" height="800"',
    ):
        assert part in body
    flat = body.replace("\n", "")
    assert "<ul><li>one<ol><li>nested</li></ol><p>more</p></li><li>two</li></ul>" in flat
    assert [path.name for path in pictures] == ["window.png", "window-dark.png"]


def test_without_a_display_a_page_is_printed(forcelab, monkeypatch):
    for name in ("QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    page = read_page("index")
    assert forcelab("guide").out == page.text
    content = json.loads(forcelab("guide", "index", "--json").out)
    assert content == {"page": "index", "title": page.title, "text": page.text}


def test_an_unknown_page_is_one_sentence(forcelab):
    result = forcelab("guide", "lable")
    assert result.status == 1
    assert result.err.startswith("forcelab: There is no page 'lable'; did you mean 'label'?")
