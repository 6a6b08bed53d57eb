"""Links, pictures and commands of the site: every link between its pages leads somewhere, every picture has words in
its place, every command that it shows runs.

`python check.py out/site` in this folder's repository prints what is wrong and counts what was tried.
"""

import os
import re
import subprocess
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import unquote

FOLDER = Path(__file__).parent
PAGES = (FOLDER / "start.md", *sorted((FOLDER / "tasks").glob("*.md")))


class _Page(HTMLParser):
    """Links of a page, the names that can be linked in it, and its pictures without alternative text."""

    def __init__(self):
        super().__init__()
        self.links = []
        self.names = set()
        self.mute = []

    def handle_starttag(self, tag, attrs):
        of = dict(attrs)
        self.links += [of[key] for key in ("href", "src") if of.get(key)]
        self.names |= {of[key] for key in ("id", "name") if of.get(key)}
        self.mute += (
            [of["src"]] if tag == "img" and of.get("alt", of["src"]) in ("", of["src"]) else []
        )


@cache
def read(path: Path) -> _Page:
    """Read a page of HTML once."""
    page = _Page()
    page.feed(path.read_text("utf-8"))
    return page


def _pages(folder: Path) -> list:
    """Return the pages of a built site, without the templates of the theme."""
    return sorted(set(folder.rglob("*.html")) - set(folder.rglob("_static/**/*.html")))


def mute(folder: Path) -> list:
    """Return the pictures of a built site that have no alternative text, as "page: picture"."""
    return [
        f"{path.relative_to(folder)}: {name}" for path in _pages(folder) for name in read(path).mute
    ]


def links(folder: Path) -> tuple:
    """Return the number of links inside a built site, and those without a target as "page: link"."""
    tried = 0
    dead = []
    for path in _pages(folder):
        for link in read(path).links:
            target, _, name = unquote(link).partition("#")
            if re.match(r"[a-z]+:|//", target) or not (target or name):
                continue
            tried += 1
            to = (path.parent / target.partition("?")[0]).resolve() if target else path
            known = to.exists() and (not name or to.suffix != ".html" or name in read(to).names)
            dead += [] if known else [f"{path.relative_to(folder)}: {link}"]
    return tried, dead


def commands(page: Path) -> list:
    """Return the commands that a page shows as bash, in order."""
    blocks = re.findall(r"^```bash\n(.*?)^```", page.read_text("utf-8"), re.S | re.M)
    return [line for block in blocks for line in block.splitlines() if line.strip()]


def faults(page: Path) -> list:
    """Run the commands of a page one after the other in an empty folder and list those that fail."""
    place = os.environ | {
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    }
    with TemporaryDirectory() as room:
        for line in commands(page):
            done = subprocess.run(
                line, shell=True, cwd=room, env=place, capture_output=True, text=True
            )
            if done.returncode:
                return [f"{page.name}: {line}: {done.stderr.strip()[-300:]}"]
    return []


def main(site: str) -> int:
    """Print all faults; return 1 if there are any."""
    tried, wrong = links(Path(site))
    print(f"{tried} links tried, {len(wrong)} dead")
    silent = mute(Path(site))
    print(f"{len(silent)} pictures without words in their place")
    failed = [text for page in PAGES for text in faults(page)]
    print(f"{sum(len(commands(page)) for page in PAGES)} commands tried, {len(failed)} fail")
    print(*wrong, *silent, *failed, sep="\n")
    return int(bool(wrong or silent or failed))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
