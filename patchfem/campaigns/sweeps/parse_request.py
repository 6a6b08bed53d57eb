"""From the words of a request to the scene and the cases of a sweep, every mistake named at once."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from math import prod
from pathlib import Path

from ...response import rows
from ...runs.results import patch_rows
from ...scene.axes import Axis, read_axes
from ...scene.keys.quantities import NUMBER_PATTERN
from ...scene.lines import split_key
from ...scene.scene import SceneError
from ...scene.toml_text import read_text
from . import samples, table
from .case_models import Asked
from .cases import Cases, product

LOOKED = 32  # cases that are read before a sweep starts, to find one that is valid
SHOWN = 12  # mistakes that are printed
NEAR = 4  # measures that a mistaken name may mean
MOST = 3_000_000  # cases of a sweep: their names and columns fill some gigabytes


@dataclass(frozen=True, slots=True)
class Request:
    """Which cases are asked for.

    over: "table.key=values" texts; file: a table with a case per row, or None; count: cases to draw between the ends of
    the ranges of `over`, 0 for all combinations, from Sobol's sequence or independent ones, by `seed`; of: the measure
    that the answer begins with, "" for the usual one.
    """

    over: Sequence[str] = ()
    file: Path | None = None
    count: int = 0
    sobol: bool = False
    seed: int = 0
    of: str = ""


def asked_of(path: Path, sets: Sequence[str], request: Request) -> tuple[Asked, Cases]:
    """The scene in a file and its cases; SceneError as `cases_of`, and where a key is set for all cases and swept."""
    asked = Asked(Path(path), read_text(path), tuple(sets), request.of)
    cases = cases_of(asked, request)
    swept = {asked.place(axis.key): axis.key for axis in cases.axes}
    both = [
        (one, swept.get(asked.place(".".join(split_key(one.partition("=")[0]))))) for one in sets
    ]
    if any(key for _, key in both):
        raise SceneError(
            [
                f"--set {one}: the sweep already sets {key} in every case; remove this --set, or remove the "
                "key from the sweep"
                for one, key in both
                if key
            ]
        )
    return asked, cases


def cases_of(asked: Asked, request: Request) -> Cases:
    """The cases of a request: all combinations of what it names, or of the table [sweep] where it names nothing.

    SceneError names the mistakes of scene and request, also where none of the cases that are looked at is valid.
    """
    parts, wrong = [], []
    if min(request.count, request.seed) < 0 or (request.sobol and not request.count):
        raise SceneError(
            [
                f"{request.count} random cases with seed {request.seed}: the number of cases and the seed "
                "must be whole numbers >= 0, and Sobol's sequence needs at least one case"
            ]
        )
    if request.file is not None:
        listed, wrong = table.read(request.file)
        parts += [listed] if listed is not None else []
    wrong += _unknown(request.of)
    axes, mistakes = read_axes(request.over, sampled=request.count > 0)
    wrong += [f"--over {one.removeprefix('--over ')}" for one in mistakes]
    if not request.over and request.file is None:
        axes, mistakes = asked.axes()
        wrong += mistakes
        if not axes and not mistakes:
            wrong.append(
                f"{asked.path}: no key to sweep is given; add --over table.key=v1,v2,... or a table [sweep]"
            )
    twice = {axis.key for part in parts for axis in part.axes} & {axis.key for axis in axes}
    wrong += [
        f"--over {key}: {request.file} sets this key already; remove the key from the file or leave out this "
        "--over"
        for key in sorted(twice)
    ]
    if not wrong:
        wrong += _same(
            asked, [axis.key for axis in (*axes, *(one for part in parts for one in part.axes))]
        )
    if wrong:
        first = [
            f"{axis.key}={axis.texts[0]}"
            for axis in (*axes, *(one for part in parts for one in part.axes))
            if isinstance(axis, Axis)
        ]
        raise SceneError([*asked.mistakes(first), *wrong])
    count = prod(
        [
            *map(len, parts),
            *([request.count] if request.count else [len(axis.texts) for axis in axes]),
        ]
    )
    if count > MOST:
        raise SceneError(
            [
                f"{asked.path}: the sweep has {count} cases, more than the largest number possible ({MOST}); "
                "give fewer values for each key, or draw N cases from the ranges with --sobol N"
            ]
        )
    if request.count and axes:
        parts.append(samples.drawn(axes, request.count, request.sobol, request.seed))
    elif axes:
        parts.append(Cases(tuple(axes)))
    cases = product(parts)
    if cases.rows:
        cases = replace(cases, words=_words(request, asked.path.parent))
    _refuse_all(asked, cases)
    return cases


def _words(request: Request, folder: Path) -> tuple[str, ...]:
    """What asks for the same cases again in a folder, as words of a command; () where their file is a pipe."""
    if request.file is not None and not request.file.is_file():
        return ()
    file = () if request.file is None else ("--cases", os.path.relpath(request.file, folder))
    drawn = (
        "--sobol" if request.sobol else "--random",
        str(request.count),
        "--seed",
        str(request.seed),
    )
    return (
        *file,
        *(word for one in request.over for word in ("--over", one)),
        *(drawn if request.count else ()),
    )


def _unknown(measure: str) -> list[str]:
    """A mistake where a measure is named that no run has, with those that it is a word of, or the one that is
    nearest."""
    known = [*rows.TABLE, *patch_rows.TABLE]
    if not measure or rows.of_first(measure) in known:
        return []
    parts = [name for name in known if measure in name.split("_") and not name.endswith("_scatter")]
    near = parts if 0 < len(parts) <= NEAR else get_close_matches(measure, known, 1, 0.5)
    *others, last = map(repr, near or [""])
    return [
        f"--of {measure}: unknown measure; "
        + (
            f"did you mean {', '.join(others)}{' or ' * bool(others)}{last}?"
            if near
            else "use a name that `patchfem run` prints, such as loop_area"
        )
    ]


def _same(asked: Asked, keys: Sequence[str]) -> list[str]:
    """A mistake for each key that stands for the same value as one before it, by the name and by the number of a
    mode."""
    first, wrong = {}, []
    for key in keys:
        place = asked.place(key)
        if first.setdefault(place, key) != key:
            wrong.append(
                f"--over {key}: this key is the same as {first[place]}, which is given already; remove one of "
                "them"
            )
    return wrong


def _refuse_all(asked: Asked, cases: Cases) -> None:
    """SceneError with the mistakes of cases spread over the sweep where none of these is a valid scene."""
    found = {}
    for number in cases.looked(LOOKED):
        mistakes = asked.mistakes(cases.sets(number))
        if not mistakes:
            return
        for one in mistakes:  # drawn values differ, and what is wrong with them does not
            found.setdefault(re.sub(NUMBER_PATTERN, "", one) if cases.drawn else one, one)
    lines = list(found.values())
    raise SceneError(
        lines[:SHOWN] + ([f"and {len(lines) - SHOWN} more"] if len(lines) > SHOWN else [])
    )


def contradictions(asked: Asked, cases: Cases) -> str:
    """That cases of a sweep will fail since a swept key contradicts another key of the scene, and what helps; of LOOKED
    cases spread over the sweep, "" where each of these is a valid scene."""
    numbers = cases.looked(LOOKED)
    found = [one for one in map(asked.mistakes, map(cases.sets, numbers)) if one]
    if not found:
        return ""
    first, swept = found[0][0], {asked.place(axis.key) for axis in cases.axes}
    key = re.search(r"(?:^|: )([a-z_]+(?:\.[\w-]+)+): ", first)
    helps = (
        f"sweep {key[1]}, too, remove this key from the scene, or give other values in --over"
        if key and asked.place(key[1]) not in swept
        else "give other values in --over"
    )
    of = (
        f"{len(found)} of {len(cases)} cases"
        if len(numbers) == len(cases)
        else f"{len(found)} of {len(numbers)} cases that were checked"
    )
    return f"{of} will fail: {first}; {helps}"
