"""Remarks without the places of files: results say what was read, not where it lay on somebody's machine."""

import re
from pathlib import Path

from ...scales import tidied

_BEFORE = re.compile(r"/[^:]*/(?=[^/:]+: )")  # of an absolute path at the start of a remark


def placeless(texts, path: Path) -> list:
    """Remarks in which a file is named without its folder where that is absolute, and numbers are written for people;
    path: of the scene, beside which files lie."""
    folders = [f"{folder}/" for folder in (path.parent, path.parent.absolute()) if folder.is_absolute()]
    out = []
    for text in texts:
        for folder in folders:
            text = text.replace(folder, "")
        out.append(tidied(_BEFORE.sub("", text, count=1) if text.startswith("/") else text))
    return out
