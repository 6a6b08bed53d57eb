"""The verb that reads a measured surface and prints its roughness."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from .shared import Json, Out, Refused, say

Length = Annotated[str, Parameter(allow_leading_hyphen=True)]


def profile(file: Path, /, *more: Path, cutoff: Length = "", window: Length = "", tip: Length = "", units: str = "",
            out: Out = None, json_: Json = False,
            verbose: Annotated[bool, Parameter(name=["-v", "--verbose"], negative=())] = False):
    """Print roughness parameters of each FILE with the intervals that one trace allows; a page goes to -o DIR.

    --cutoff "0.25 mm" splits off the roughness profile; --window "468 um,733 um" takes the part between two cursors;
    --tip "12.5 um" checks the valleys against the stylus; --units "mm,um" names the units of x and z where the file
    names none; -v prints the definitions.
    """
    asked = {"cutoff": _length("cutoff", cutoff) if cutoff else None, "window": _window(window) if window else None,
             "tip": _length("tip", tip) if tip else None}
    for name in ("cutoff", "tip"):
        if asked[name] is not None and asked[name] <= 0:
            raise Refused(f"profile --{name} {cutoff if name == 'cutoff' else tip}: a length above zero is wanted")
    from ..export.surfaces.roughness import data_of, lines_of, write_page
    from ..surface.files.read import read_surface
    from ..surface.roughness.report import report_of

    named = tuple(word.strip() for word in units.split(",")) if units else None
    reports = [report_of(read_surface(path, named), **asked) for path in (file, *more)]
    for report in reports:
        if not json_:
            print("\n".join(lines_of(report, verbose)))
        for text in report.notes:
            say(f"note: {text}")
    from .. import __version__

    answer = {"patchfem": __version__, "profiles": [data_of(one) for one in reports]}
    if out is not None:
        from ..export.results import Folder
        from ..export.summary import write_json

        with Folder(out) as folder:
            write_page(folder.path / "report.html", reports)
            write_json(answer, folder.path / "profile.json")
    if json_:
        print(json.dumps(answer, ensure_ascii=False, allow_nan=False))
    elif out is not None:
        print(f"results: {out}")


def _length(name: str, text: str) -> float:
    from ..scene.keys.quantities import parse

    try:
        return parse(text, "length")
    except ValueError as error:
        raise Refused(f"profile --{name}: {error}") from None


def _window(text: str) -> tuple:
    words = text.split(",")
    if len(words) != 2:
        raise Refused(f"profile --window '{text}': two places are wanted, such as '468 um,733 um'")
    return tuple(_length("window", word) for word in words)
