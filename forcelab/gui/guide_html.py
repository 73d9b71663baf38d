"""The guide as static web pages, from the same documents that the window shows."""

from __future__ import annotations

from html import escape
from itertools import groupby
from pathlib import Path
from string import Template

from PySide6.QtCore import QUrl
from PySide6.QtGui import (
    QFont,
    QImageReader,
    QTextBlock,
    QTextCursor,
    QTextDocument,
    QTextFormat,
    QTextFragment,
    QTextImageFormat,
    QTextListFormat,
    QTextTable,
)

from forcelab.formats.output_folder import output_folder
from forcelab.gui.figures.text import ensure_application
from forcelab.gui.guide import fragments, is_code, picture_path, read_markdown, starts_code
from forcelab.gui.theme import DARK, LIGHT, Colours
from forcelab.guide import Page, read_pages
from forcelab.io import write_atomically

_PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>$title – forcelab</title>
<link rel="stylesheet" href="guide.css">
</head>
<body>
<p class="to-contents"><a href="#contents">Contents</a></p>
<main>
$body
<p class="steps">$steps</p>
</main>
<nav id="contents" aria-label="Contents">
$contents
</nav>
</body>
</html>
""")

_SHEET = Template("""\
:root { $light }
@media (prefers-color-scheme: dark) { :root { $dark } }
* { box-sizing: border-box; }
body { margin: 0; color: var(--text); background: var(--background);
  font: 1rem/1.5 system-ui, sans-serif; overflow-wrap: break-word; }
main { padding: 1rem 1.25rem 3rem; max-width: 52rem; min-width: 0; }
h1, h2, h3, h4 { line-height: 1.25; margin: 2em 0 0.5em; }
h1 { font-size: 1.8rem; margin-top: 0.5em; }
h2 { font-size: 1.35rem; }
h3, h4 { font-size: 1.1rem; }
a { color: var(--link); }
img { max-width: 100%; height: auto; border: 1px solid var(--edge); border-radius: 4px; }
code, pre { font: 0.875em/1.45 ui-monospace, monospace; }
pre code { font: inherit; }
:not(pre) > code { background: var(--panel); padding: 0.1em 0.3em; border-radius: 3px; }
pre { background: var(--panel); border: 1px solid var(--edge); border-radius: 4px;
  padding: 0.75em 1em; overflow-x: auto; }
.table { overflow-x: auto; margin: 1em 0; }
table { border-collapse: collapse; }
th, td { border: 1px solid var(--edge); padding: 0.35em 0.6em; text-align: left;
  vertical-align: top; }
th { background: var(--panel); }
blockquote { margin: 1em 0; padding-left: 1em; border-left: 3px solid var(--edge);
  color: var(--muted); }
nav { padding: 1rem 1.25rem; background: var(--panel); }
nav ul { list-style: none; margin: 0; padding: 0; }
nav ul ul { padding-left: 1em; font-size: 0.9em; }
nav a { display: block; padding: 0.2em 0.4em; color: var(--text); text-decoration: none;
  border-radius: 4px; }
nav a:hover { background: var(--edge); }
nav a[aria-current] { background: var(--accent); color: var(--accent-text); }
.to-contents { margin: 0; padding: 0.75rem 1.25rem; background: var(--panel); }
.steps { display: flex; justify-content: space-between; gap: 1em; margin-top: 3em;
  padding-top: 1em; border-top: 1px solid var(--edge); }
@media (min-width: 60rem) {
  body { display: grid; grid-template-columns: 17rem 1fr; }
  nav { grid-column: 1; grid-row: 1; position: sticky; top: 0; height: 100vh; overflow-y: auto; }
  main { grid-column: 2; grid-row: 1; padding: 1.5rem 2.5rem 4rem; }
  .to-contents { display: none; }
}
@media print { nav, .to-contents, .steps { display: none; } }
""")


def write_guide(folder: Path) -> list[Path]:
    """Write all pages with their pictures into a folder; returns the files.

    Raises InputError if it cannot be written.
    """
    ensure_application()  # a document asks for fonts
    pages = read_pages()
    written: list[Path] = []
    with output_folder(folder):
        for page in pages:
            text, pictures = page_html(page, pages)
            written.append(_write(folder / f"{page.name}.html", text))
            for picture in pictures:
                target = folder / "pictures" / picture.name
                target.parent.mkdir(exist_ok=True)
                write_atomically(target, picture.read_bytes())
                written.append(target)
        sheet = _SHEET.substitute(light=_variables(LIGHT), dark=_variables(DARK))
        written.append(_write(folder / "guide.css", sheet))
    return list(dict.fromkeys(written))


def page_html(page: Page, pages: tuple[Page, ...]) -> tuple[str, list[Path]]:
    """One page as HTML, and the files of the pictures in it."""
    document = QTextDocument()
    read_markdown(document, page)
    writer = _Writer()
    writer.write(document)
    number = pages.index(page)
    steps = [f'<a href="{p.name}.html">← {escape(p.title)}</a>' for p in pages[:number][-1:]]
    steps += ["<span></span>"] * (not steps)
    steps += [f'<a href="{p.name}.html">{escape(p.title)} →</a>' for p in pages[number + 1 :][:1]]
    text = _PAGE.substitute(
        title=escape(page.title),
        body="\n".join(writer.parts),
        contents=_contents(page, pages),
        steps="".join(steps),
    )
    return text, writer.pictures


def _write(path: Path, text: str) -> Path:
    write_atomically(path, text.encode())
    return path


def _variables(colours: Colours) -> str:
    link = colours.curves[0] if colours.dark else colours.accent
    values = {
        "text": colours.text,
        "background": colours.background,
        "muted": colours.muted,
        "panel": colours.panel,
        "edge": colours.panel_edge,
        "accent": colours.accent,
        "accent-text": colours.accent_text,
        "link": link,
    }
    return " ".join(f"--{name}: {value};" for name, value in values.items())


def _contents(page: Page, pages: tuple[Page, ...]) -> str:
    """The navigation: all pages, and the headings of the one that is shown."""
    lines = ["<ul>"]
    for other in pages:
        here = ' aria-current="page"' if other is page else ""
        lines.append(f'<li><a href="{other.name}.html"{here}>{escape(other.title)}</a>')
        sections = [section for section in other.sections[1:] if section.level == 2]
        if other is page and sections:
            lines.append("<ul>")
            lines += [f'<li><a href="#{s.anchor}">{escape(s.title)}</a></li>' for s in sections]
            lines.append("</ul>")
        lines.append("</li>")
    return "\n".join([*lines, "</ul>"])


class _Writer:
    """Writes the paragraphs of a document as HTML."""

    def __init__(self) -> None:
        self.parts: list[str] = []
        self.pictures: list[Path] = []
        self._lists: list[tuple[int, str]] = []  # those that are open: indent and tag

    def write(self, document: QTextDocument) -> None:
        block = document.begin()
        while block.isValid():
            table = QTextCursor(block).currentTable()
            if table:
                self._close_lists()
                self._write_table(table)
                block = table.lastCursorPosition().block().next()
            elif is_code(block):
                block = self._write_code(block)
            else:
                self._write_paragraph(block)
                block = block.next()
        self._close_lists()

    def _write_paragraph(self, block: QTextBlock) -> None:
        block_format = block.blockFormat()
        level = block_format.headingLevel()
        items = block.textList()
        if items:
            ordered = items.format().style() == QTextListFormat.Style.ListDecimal
            self._begin_item(items.format().indent(), "ol" if ordered else "ul")
            self.parts.append(self._inline(block))
            return
        self._close_lists(block_format.indent())
        if level:
            names = {n for part in fragments(block) for n in part.charFormat().anchorNames()}
            anchor = escape(next(iter(names), ""))
            heading = self._inline(block, bold=False)
            self.parts.append(f'<h{level} id="{anchor}">{heading}</h{level}>')
        elif block_format.hasProperty(QTextFormat.Property.BlockTrailingHorizontalRulerWidth):
            self.parts.append("<hr>")
        elif block.text():
            paragraph = f"<p>{self._inline(block)}</p>"
            quoted = block_format.hasProperty(QTextFormat.Property.BlockQuoteLevel)
            self.parts.append(f"<blockquote>{paragraph}</blockquote>" if quoted else paragraph)

    def _begin_item(self, indent: int, tag: str) -> None:
        """Open an item, and its list if that is not open; close what lies deeper."""
        self._close_lists(indent)
        if self._lists and self._lists[-1] == (indent, tag):
            self.parts.append("</li>\n<li>")
            return
        self._close_lists(indent - 1)
        self._lists.append((indent, tag))
        self.parts.append(f"<{tag}>\n<li>")

    def _close_lists(self, indent: int = 0) -> None:
        """Close the lists that are indented more than this."""
        while self._lists and self._lists[-1][0] > indent:
            self.parts.append(f"</li>\n</{self._lists.pop()[1]}>")

    def _write_code(self, block: QTextBlock) -> QTextBlock:
        """Write a block of code; returns the paragraph behind it."""
        self._close_lists(block.blockFormat().indent())
        lines = [block.text()]
        block = block.next()
        while block.isValid() and is_code(block) and not starts_code(block):
            lines.append(block.text())
            block = block.next()
        self.parts.append(f"<pre><code>{escape(chr(10).join(lines), quote=False)}</code></pre>")
        return block

    def _write_table(self, table: QTextTable) -> None:
        rows = []
        for row in range(table.rows()):
            cells = []
            for column in range(table.columns()):
                block = table.cellAt(row, column).firstCursorPosition().block()
                tag, bold = ("td", True) if row else ("th", False)
                cells.append(f"<{tag}>{self._inline(block, bold=bold)}</{tag}>")
            rows.append(f"<tr>{''.join(cells)}</tr>")
        body = "\n".join(rows[1:])
        self.parts.append(
            f'<div class="table"><table>\n<thead>{rows[0]}</thead>\n<tbody>\n{body}\n</tbody>\n'
            "</table></div>"
        )

    def _inline(self, block: QTextBlock, *, bold: bool = True) -> str:
        """The text of a paragraph; `bold` is left out where all of it is."""
        text = ""
        for link, parts in groupby(fragments(block), lambda part: part.charFormat().anchorHref()):
            words = "".join(self._fragment(part, bold) for part in parts)
            text += f'<a href="{escape(_address(link))}">{words}</a>' if link else words
        return text

    def _fragment(self, part: QTextFragment, bold: bool) -> str:
        style = part.charFormat()
        if style.isImageFormat():
            return self._picture(style.toImageFormat())
        text = escape(part.text(), quote=False).replace("\u2028", "<br>")
        if style.fontFixedPitch():
            text = f"<code>{text}</code>"
        if style.fontItalic():
            text = f"<em>{text}</em>"
        if bold and style.fontWeight() >= QFont.Weight.Bold:
            text = f"<strong>{text}</strong>"
        return text

    def _picture(self, picture: QTextImageFormat) -> str:
        name = picture.name()
        light, dark = picture_path(name, False), picture_path(name, True)
        self.pictures += [light, dark]
        size = QImageReader(str(light)).size()
        alt = escape(picture.stringProperty(QTextFormat.Property.ImageAltText.value))
        image = (
            f'<img src="{escape(name)}" alt="{alt}" width="{size.width()}" '
            f'height="{size.height()}" loading="lazy">'
        )
        if dark == light:
            return image
        source = escape(f"pictures/{dark.name}")
        return (
            f'<picture><source srcset="{source}" media="(prefers-color-scheme: dark)">'
            f"{image}</picture>"
        )


def _address(link: str) -> str:
    """Where a link of a page leads among the web pages."""
    url = QUrl(link)
    if not url.scheme() and url.path().endswith(".md"):
        url.setPath(f"{url.path().removesuffix('.md')}.html")
    return url.toString()
