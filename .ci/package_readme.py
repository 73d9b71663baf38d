"""Makes what a package index shows of the README, where links to files beside it lead nowhere.

hatchling calls this whenever it builds the package; pyproject.toml names it. Once the repository
has a public address, links and pictures can lead there instead.
"""

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

PICTURE = re.compile(r"^!\[[^\]]*\]\([^)]*\)\n+", re.MULTILINE)
FILE = re.compile(r"\[([^\[\]]*)\]\((?!#|https?:)[^)]*\)")


class ReadmeHook(MetadataHookInterface):
    def update(self, metadata: dict[str, Any]) -> None:
        """Set the README, without pictures and with plain text in place of links to files."""
        text = PICTURE.sub("", Path(self.root, "README.md").read_text("utf-8"))
        metadata["readme"] = {"content-type": "text/markdown", "text": FILE.sub(r"\1", text)}
