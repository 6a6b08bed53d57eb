"""Parser and validation of the request for a sweep, which reports all errors at once.

In: a file, --set strings and a `CaseRequest`. Out: `SweepScene` and `Cases`, or a SceneError.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from math import prod
from pathlib import Path

from ...scene.assignments import (
    LIST_FORM,
    RANDOM_FORM,
    Axis,
    read_assignments,
    require_possible_count,
)
from ...scene.keys.lines import split_assignment, split_key
from ...scene.keys.quantities import NUMBER_PATTERN
from ...scene.scene import SceneError
from ...scene.toml_text import read_text
from . import samples, table
from .case_models import SweepScene
from .cases import Cases, combine_cases

N_CHECKED_CASES = 32  # Largest number of cases that are validated before a sweep starts.
MAX_PRINTED_MISTAKES = 12  # Largest number of validation errors that are printed.


@dataclass(frozen=True, slots=True)
class CaseRequest:
    """Cases that the user asks for in a sweep: swept keys, table of cases and random sampling.

    Attributes
    ----------
    over : sequence of str
        Swept keys as "table.key=values" strings.
    file : Path or None
        CSV table with a row for each case.
    count : int
        Number of random cases within the ranges of `over`; 0 for all combinations.
    sobol : bool
        Whether the random cases form a Sobol sequence.
    seed : int
        Seed of the random cases.
    """

    over: Sequence[str] = ()
    file: Path | None = None
    count: int = 0
    sobol: bool = False
    seed: int = 0

    def list_options(self) -> list[str]:
        """Return the words of the command line that ask for the same cases, without a file."""
        words = []
        for text in self.over:
            words += ["--over", text]
        if self.count:
            words += ["--sobol" if self.sobol else "--random", str(self.count)]
            words += ["--seed", str(self.seed)]
        return words


def read_sweep(path: Path, sets: Sequence[str], request: CaseRequest) -> tuple[SweepScene, Cases]:
    """Read the scene of a sweep and its cases.

    Parameters
    ----------
    path : Path
        File of the scene.
    sets : sequence of str
        ``table.key=value`` strings for all cases.
    request : CaseRequest
        Which cases are asked for.

    Returns
    -------
    tuple of SweepScene and Cases

    Raises
    ------
    SceneError
        As for `read_cases`, and if a key is both set for all cases and swept.
    """
    sweep_scene = SweepScene(Path(path), read_text(path), tuple(sets))
    cases = read_cases(sweep_scene, request)
    swept_keys = {sweep_scene.replace_mode_name(axis.key): axis.key for axis in cases.axes}
    errors = []
    for text in sets:
        key = ".".join(split_key(split_assignment(text)[0]))
        swept_key = swept_keys.get(sweep_scene.replace_mode_name(key))
        if swept_key:
            errors.append(
                f"--set {text}: the sweep already sets {swept_key} in every case; remove this --set, "
                "or remove the key from the sweep"
            )
    if errors:
        raise SceneError(errors)
    return sweep_scene, cases


def read_cases(sweep_scene: SweepScene, request: CaseRequest) -> Cases:
    """Return the cases of a request: all combinations of the requested values.

    If it names no values, those of the table [sweep] are used.

    Parameters
    ----------
    sweep_scene : SweepScene
        Scene of the sweep.
    request : CaseRequest
        Values, ranges and tables of cases that the user asks for.

    Returns
    -------
    Cases
        With a warning if some of the checked cases are invalid.

    Raises
    ------
    SceneError
        With all validation errors of scene and request; also if none of the checked cases is valid.
    """
    if min(request.count, request.seed) < 0 or (request.sobol and not request.count):
        raise SceneError(
            [
                f"{request.count} random cases with seed {request.seed}: the number of cases and the seed "
                "must be whole numbers >= 0, and Sobol's sequence needs at least one case"
            ]
        )

    # Cases of the file come first; the table [sweep] counts only if the request names no key.
    parts = []
    errors = []
    file_axes: tuple[Axis, ...] = ()
    if request.file is not None:
        listed, errors = table.read_case_table(request.file)
        if listed is not None:
            parts.append(listed)
            file_axes = listed.axes

    axes, axis_errors = read_assignments(request.over, RANDOM_FORM if request.count else LIST_FORM)
    errors += axis_errors
    if not request.over and request.file is None:
        axes, axis_errors = sweep_scene.read_axes()
        errors += axis_errors
        if not axes and not axis_errors:
            errors.append(
                f"{sweep_scene.path}: no key to sweep is given; add --over table.key=v1,v2,... or a table [sweep]"
            )

    for key in sorted({axis.key for axis in file_axes} & {axis.key for axis in axes}):
        errors.append(
            f"--over {key}: {request.file} sets this key already; remove the key from the file or leave out "
            "this --over"
        )

    every_axis = [*axes, *file_axes]
    # Errors of the scene are reported with those of the request, for the first value of each axis.
    errors = errors or _find_duplicate_keys(sweep_scene, [axis.key for axis in every_axis])
    if errors:
        listed_axes = [axis for axis in every_axis if isinstance(axis, Axis)]
        first_case = [f"{axis.key}={axis.texts[0]}" for axis in listed_axes]
        raise SceneError([*sweep_scene.find_errors(first_case), *errors])

    # All combinations of the cases of a file and of the values of the axes, or random cases in place of the latter
    count = prod(map(len, parts))
    count *= request.count or prod(len(axis.texts) for axis in axes)
    try:
        require_possible_count(count)
    except ValueError as error:
        raise SceneError([f"{sweep_scene.path}: {error}"]) from None

    if request.count and axes:
        parts.append(samples.draw_cases(axes, request.count, request.seed, sobol=request.sobol))
    elif axes:
        parts.append(Cases(tuple(axes)))

    cases = combine_cases(parts)
    return replace(cases, warning=_check_cases(sweep_scene, cases))


def _find_duplicate_keys(sweep_scene: SweepScene, keys: Sequence[str]) -> list[str]:
    """Return a validation error for each of the swept keys that is equivalent to an earlier one.

    Two keys are equivalent if they denote a mode by its name and by its index.

    `sweep_scene` knows the modes by name.
    """
    first_keys: dict[str, str] = {}
    errors = []
    for key in keys:
        first = first_keys.setdefault(sweep_scene.replace_mode_name(key), key)
        if first != key:
            errors.append(
                f"--over {key}: this key is the same as {first}, which is given already; remove one of them"
            )
    return errors


def _check_cases(sweep_scene: SweepScene, cases: Cases) -> str:
    """Validate the representative cases of a sweep.

    Parameters
    ----------
    sweep_scene : SweepScene
        Scene of the sweep.
    cases : Cases
        All cases, of which some are checked.

    Returns
    -------
    str
        Warning if some of them are invalid, because a swept key contradicts another one; "" otherwise.

    Raises
    ------
    SceneError
        If none of them is valid.
    """
    # the first random cases are as good as any others
    numbers = cases.spread_case_numbers(N_CHECKED_CASES)
    if cases.is_random:
        numbers = range(min(N_CHECKED_CASES, len(cases)))
    errors = [sweep_scene.find_errors(cases.assignments(number)) for number in numbers]
    invalid = list(filter(None, errors))
    if not invalid:
        return ""
    if len(invalid) == len(numbers):
        messages: dict[str, str] = {}
        for message in chain.from_iterable(invalid):
            # Errors that differ only in their random values are reported once.
            kind = re.sub(NUMBER_PATTERN, "", message) if cases.is_random else message
            messages.setdefault(kind, message)
        lines = list(messages.values())
        if len(lines) > MAX_PRINTED_MISTAKES:
            lines = [*lines[:MAX_PRINTED_MISTAKES], f"and {len(lines) - MAX_PRINTED_MISTAKES} more"]
        raise SceneError(lines)

    extent = f"{len(invalid)} of {len(numbers)} cases"
    if len(numbers) != len(cases):
        extent += " that were checked"
    return f"{extent} will fail: {invalid[0][0]}; give other values in --over, or sweep the contradicting key, too"
