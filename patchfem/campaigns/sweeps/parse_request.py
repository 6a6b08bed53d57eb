"""Parser of the request for a sweep, which reports all mistakes at once.

In: a file, --set strings and a `Request`. Out: `SweepScene` and `Cases`, or a SceneError.
"""

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
from .case_models import SweepScene
from .cases import Cases, combine_cases

N_CHECKED = 32  # Number of cases that are read before a sweep starts, to find a valid one.
MAX_PRINTED = 12  # Largest number of mistakes that are printed.
MAX_SUGGESTIONS = 4  # Largest number of measures that a mistyped name may mean.
MAX_CASES = 3_000_000  # Largest number of cases; the names and columns of more take gigabytes.


@dataclass(frozen=True, slots=True)
class Request:
    """Request for a sweep: its swept keys, table of cases and random sampling.

    Attributes
    ----------
    over : sequence of str
        Texts "table.key=values".
    file : Path or None
        Table with a case per row.
    count : int
        Number of random cases between the ends of the ranges of `over`; 0 for all combinations.
    sobol : bool
        Whether the random cases are points of a Sobol sequence.
    seed : int
    of : str
        Measure that the summary of the sweep begins with; "" for the default one.
    """

    over: Sequence[str] = ()
    file: Path | None = None
    count: int = 0
    sobol: bool = False
    seed: int = 0
    of: str = ""


def read_sweep(path: Path, sets: Sequence[str], request: Request) -> tuple[SweepScene, Cases]:
    """Read the scene of a sweep and its cases.

    Parameters
    ----------
    path : Path
        File of the scene.
    sets : sequence of str
        ``table.key=value`` strings for all cases.
    request : Request

    Returns
    -------
    tuple of SweepScene and Cases

    Raises
    ------
    SceneError
        As from `read_cases`, and if a key is both set for all cases and swept.
    """
    sweep_scene = SweepScene(Path(path), read_text(path), tuple(sets), request.of)
    cases = read_cases(sweep_scene, request)
    swept = {sweep_scene.numbered_key(axis.key): axis.key for axis in cases.axes}
    mistakes = []
    for text in sets:
        key = ".".join(split_key(text.partition("=")[0]))
        swept_key = swept.get(sweep_scene.numbered_key(key))
        if swept_key:
            mistakes.append(
                f"--set {text}: the sweep already sets {swept_key} in every case; remove this --set, "
                "or remove the key from the sweep"
            )
    if mistakes:
        raise SceneError(mistakes)
    return sweep_scene, cases


def read_cases(sweep_scene: SweepScene, request: Request) -> Cases:
    """Return the cases of a request: all combinations of the values that it names.

    If it names none, the values are those of the table [sweep].

    Raises
    ------
    SceneError
        With the mistakes of scene and request, and if none of the cases that are checked is valid.
    """
    if min(request.count, request.seed) < 0 or (request.sobol and not request.count):
        raise SceneError(
            [
                f"{request.count} random cases with seed {request.seed}: the number of cases and the seed "
                "must be whole numbers >= 0, and Sobol's sequence needs at least one case"
            ]
        )
    parts = []
    mistakes = []
    file_axes: tuple = ()
    if request.file is not None:
        listed, mistakes = table.read_case_table(request.file)
        if listed is not None:
            parts.append(listed)
            file_axes = listed.axes
    mistakes += _check_measure(request.of)
    axes, axis_mistakes = read_axes(request.over, sampled=request.count > 0)
    mistakes += [f"--over {mistake.removeprefix('--over ')}" for mistake in axis_mistakes]
    if not request.over and request.file is None:
        axes, axis_mistakes = sweep_scene.axes()
        mistakes += axis_mistakes
        if not axes and not axis_mistakes:
            mistakes.append(
                f"{sweep_scene.path}: no key to sweep is given; add --over table.key=v1,v2,... or a table [sweep]"
            )
    for key in sorted({axis.key for axis in file_axes} & {axis.key for axis in axes}):
        mistakes.append(
            f"--over {key}: {request.file} sets this key already; remove the key from the file or leave out "
            "this --over"
        )
    every_axis = [*axes, *file_axes]
    mistakes = mistakes or _find_equal_keys(sweep_scene, [axis.key for axis in every_axis])
    if mistakes:
        listed_axes = [axis for axis in every_axis if isinstance(axis, Axis)]
        first_case = [f"{axis.key}={axis.texts[0]}" for axis in listed_axes]
        raise SceneError([*sweep_scene.mistakes(first_case), *mistakes])
    count = prod(map(len, parts))
    count *= request.count or prod(len(axis.texts) for axis in axes)
    if count > MAX_CASES:
        raise SceneError(
            [
                f"{sweep_scene.path}: the sweep has {count} cases, more than the largest number possible ({MAX_CASES}); "
                "give fewer values for each key, or draw N cases from the ranges with --sobol N"
            ]
        )
    if request.count and axes:
        parts.append(samples.draw_cases(axes, request.count, request.seed, sobol=request.sobol))
    elif axes:
        parts.append(Cases(tuple(axes)))
    cases = combine_cases(parts)
    if cases.rows:
        cases = replace(cases, words=_repeat_words(request, sweep_scene.path.parent))
    _refuse_all(sweep_scene, cases)
    return cases


def _repeat_words(request: Request, folder: Path) -> tuple[str, ...]:
    """Return the arguments of a command that computes the same cases again from a folder.

    They are () if the file of cases is a pipe, which cannot be read again.
    """
    words = []
    if request.file is not None:
        if not request.file.is_file():
            return ()
        words += ["--cases", os.path.relpath(request.file, folder)]
    for text in request.over:
        words += ["--over", text]
    if request.count:
        words.append("--sobol" if request.sobol else "--random")
        words += [str(request.count), "--seed", str(request.seed)]
    return tuple(words)


def _check_measure(measure: str) -> list[str]:
    """Return a mistake if no run has a requested measure, with similar names as suggestions.

    Suggested are the measures whose name contains the word, or else the one with the most similar
    name.
    """
    known = [*rows.TABLE, *patch_rows.TABLE]
    if not measure or rows.remove_interface_number(measure) in known:
        return []
    names = [name for name in known if measure in name.split("_") and not name.endswith("_scatter")]
    if not 0 < len(names) <= MAX_SUGGESTIONS:
        names = get_close_matches(measure, known, 1, 0.5)
    advice = "use a name that `patchfem run` prints, such as loop_area"
    if names:
        *others, last = map(repr, names)
        advice = f"did you mean {', '.join(others)}{' or ' * bool(others)}{last}?"
    return [f"--of {measure}: unknown measure; {advice}"]


def _find_equal_keys(sweep_scene: SweepScene, keys: Sequence[str]) -> list[str]:
    """Return a mistake for each swept key that means the same value as an earlier key.

    Two keys mean the same if they name a mode by its name and by its number.
    """
    first_keys: dict = {}
    mistakes = []
    for key in keys:
        first = first_keys.setdefault(sweep_scene.numbered_key(key), key)
        if first != key:
            mistakes.append(
                f"--over {key}: this key is the same as {first}, which is given already; remove one of them"
            )
    return mistakes


def _refuse_all(sweep_scene: SweepScene, cases: Cases) -> None:
    """Raise SceneError if none of several cases spread over the sweep is a valid scene."""
    messages: dict = {}
    for number in cases.representative_cases(N_CHECKED):
        mistakes = sweep_scene.mistakes(cases.sets(number))
        if not mistakes:
            return
        for mistake in mistakes:
            # Random values differ from case to case, but the mistake that they cause is the same.
            kind = re.sub(NUMBER_PATTERN, "", mistake) if cases.drawn else mistake
            messages.setdefault(kind, mistake)
    lines = list(messages.values())
    if len(lines) > MAX_PRINTED:
        lines = [*lines[:MAX_PRINTED], f"and {len(lines) - MAX_PRINTED} more"]
    raise SceneError(lines)


def contradictions(sweep_scene: SweepScene, cases: Cases) -> str:
    """Return a warning that cases will fail because a swept key contradicts another key.

    It says how to avoid this. It is "" if each of the N_CHECKED cases that are checked is a valid
    scene.
    """
    numbers = cases.representative_cases(N_CHECKED)
    failing = list(filter(None, (sweep_scene.mistakes(cases.sets(number)) for number in numbers)))
    if not failing:
        return ""
    mistake = failing[0][0]
    swept = {sweep_scene.numbered_key(axis.key) for axis in cases.axes}
    key = re.search(r"(?:^|: )([a-z_]+(?:\.[\w-]+)+): ", mistake)
    advice = "give other values in --over"
    if key and sweep_scene.numbered_key(key[1]) not in swept:
        advice = f"sweep {key[1]}, too, remove this key from the scene, or {advice}"
    extent = f"{len(failing)} of {len(numbers)} cases"
    if len(numbers) != len(cases):
        extent += " that were checked"
    return f"{extent} will fail: {mistake}; {advice}"
