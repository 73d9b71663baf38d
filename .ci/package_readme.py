"""Makes what a package index shows of the README: it can follow no link to a file beside it.

hatchling calls this whenever it builds the package; pyproject.toml names it.
"""

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

PICTURE = re.compile(r"^!\[[^\]]*\]\([^)]*\)\n+", re.MULTILINE)
FILE = re.compile(r"\[([^\[\]]*)\]\((?!#|https?:)[^)]*\)")
GUIDE = "The guide is in the package: `forcelab guide` opens it, as F1 does in the window.\n\n"


def package_readme(text: str) -> str:
    """The README with the way to the guide for its first picture, and without links to files."""
    return FILE.sub(r"\1", PICTURE.sub("", PICTURE.sub(GUIDE, text, count=1)))


class ReadmeHook(MetadataHookInterface):
    def update(self, metadata: dict[str, Any]) -> None:
        text = Path(self.root, "README.md").read_text("utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": package_readme(text)}
