"""What changes as the key of a sweep grows, and from where on, in one sentence: what comes first stands first."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..written import bare, resolved
from .words import NO_SLIP

MOST, WORDS = 3, 40  # changes in the sentence, and words, which the later changes give way to
WHOLE = 1 - 1e-12  # a contact fraction of 1 but for round-off
ENDS = {
    "done": "the run ends as asked", "steady": "the motion settles", "stuck": "the whole interface sticks",
    "transient": "the run ends before the motion settles", "grows": "the motion grows",
    "exceeds_travel": "the motion exceeds the travel", "leaves_contact": "the slide passes the end of the piece",
    "leaves_grooves": "the lifted mass leaves its grooves", "worn_through": "a coating is worn through",
    "no_contact": "the pieces do not touch", "not_converged": "a numerical method does not converge"}
SLIPS = "the interface slips as a whole"  # from "stuck" to "steady"
STATES = {  # measure: what its state is called once it has it, and once it has it no longer
    "contact_fraction": ("only part of the length is in contact", "the whole length is in contact"),
    "stick_fraction": ("the interface slips as a whole in part of the cycle", "the interface never slips as a whole"),
    "slip_amplitude": ("slip begins", "there is no slip")}


class Change(NamedTuple):
    """One change along a line of cases: what it is; places of the first case that has it and of the last one before it;
    whether all later ones have it too."""

    what: str
    at: int
    before: int
    stays: bool


def changes(keys: list, measures: dict, outcome: Sequence, grid: bool = True) -> str:
    """What changes first as a swept key grows, as one sentence; "" where nothing changes beyond the numerical errors.

    keys: [{`name`, `values` (n,), `texts` (n,), `words`: whether its values are words}]; the key is that of numbers
    with most values. measures: {name: (values (n,), errors (n,))}, NaN where a case has none; outcome (n,); grid: the
    cases are all combinations of the keys' values. Failed cases, and those that their errors leave open, are passed
    over.
    """
    numbers = [one for one in keys if not one["words"]]
    if not numbers or (len(keys) > 1 and not grid):
        return ""
    key = max(numbers, key=lambda one: len(set(np.asarray(one["values"]).tolist())))
    others = [one for one in keys if one is not key]
    lines, at = lines_of(key, others), shown_of(key)
    found = {}
    for line in lines:
        for one in _along(line, measures, np.asarray(outcome, str)):
            found.setdefault(one.what, []).append(one)
    order = np.asarray(key["values"], float)
    told = {}
    for each in sorted(found.values(), key=lambda each: min(order[one.at] for one in each))[:MOST]:
        told[each[0].what] = _where(each, order, at, others, len(lines))
    for count in range(len(told), 0, -1):
        said = _sentence(key["name"], list(told.items())[:count])
        if len(said.split()) <= WORDS or count == 1:
            return said
    return ""


def varies(key: dict) -> bool:
    """Whether a key has more than one value."""
    texts = key["texts"]
    return any(text != texts[0] for text in texts)


def shown_of(key: dict) -> Callable[[int], str]:
    """A function from a case to the value that a key has in it, as people read it."""
    values = np.asarray(key["values"], float)
    sizes = np.unique(values)
    apart = np.minimum(np.diff(sizes, prepend=-np.inf), np.diff(sizes, append=np.inf))

    def shown(case: int) -> str:
        return resolved(str(key["texts"][case]), values[case], apart[np.searchsorted(sizes, values[case])])

    return shown


def _sentence(name: str, told: list) -> str:
    """Changes with their places, [(what, where)], as a sentence that names each place once."""
    places = {}
    for what, where in told:
        places.setdefault(where, []).append(what)
    return f"As {name} grows: {'; '.join(f'{where} ' + ' and '.join(what) for where, what in places.items())}."


def lines_of(key: dict, others: list) -> list:
    """The cases of each combination of the other keys, by the size of the key."""
    lines = {}
    for case in np.argsort(np.asarray(key["values"], float), kind="stable").tolist():
        lines.setdefault(tuple(one["texts"][case] for one in others), []).append(case)
    return [np.array(line) for line in lines.values()]


def _along(line: np.ndarray, measures: dict, outcome: np.ndarray) -> list:
    """Every change along a line of cases."""
    out = _ends(line, outcome[line])
    for name, states in STATES.items():
        if name in measures:
            values, errors = (np.asarray(one, float)[line] for one in measures[name][:2])
            known = np.nan_to_num(errors)
            there, not_there = ((values + known < 1, values >= WHOLE) if name.endswith("fraction") else
                                (values > np.maximum(known, NO_SLIP), values <= NO_SLIP))
            out += _turn(line, np.where(there, 1.0, np.where(not_there, 0.0, np.nan)), states)
    return _once(out)


def _once(found: list) -> list:
    """The changes without those that say less of one slip that begins, or ends, at one place."""
    for said in ((SLIPS, STATES["stick_fraction"][0], STATES["slip_amplitude"][0]),
                 (ENDS["stuck"], STATES["stick_fraction"][1])):
        places = {one.what: one.at for one in found if one.what in said}
        found = [one for one in found if one.what not in said or not any(
            places.get(other) == one.at for other in said[:said.index(one.what)])]
    return found


def _ends(line: np.ndarray, outcome: np.ndarray) -> list:
    """The outcomes other than that of the first case, each where it comes first."""
    known = np.isin(outcome, list(ENDS))
    line, outcome = line[known], outcome[known]
    out = []
    for name in dict.fromkeys(outcome.tolist()):
        first = int(np.argmax(outcome == name))
        if first:
            what = SLIPS if name == "steady" and outcome[0] == "stuck" else ENDS[name]
            out.append(Change(what, int(line[first]), int(line[first - 1]), bool(np.all(outcome[first:] == name))))
    return out


def _turn(line: np.ndarray, state: np.ndarray, words: tuple) -> list:
    """Where a state, 1 or 0 or NaN for unknown, is another one than at first; words: for 1 and for 0."""
    known = np.isfinite(state)
    line, state = line[known], state[known]
    other = np.flatnonzero(state != state[:1]) if state.size else state
    if not other.size:
        return []
    first = int(other[0])
    return [Change(words[int(state[0])], int(line[first]), int(line[first - 1]), other.size == state.size - first)]


def _where(found: list, order: np.ndarray, at: Callable, others: list, lines: int) -> str:
    """From where on there is a change: of the line that has it first and of the one that has it last.

    One other key is named with its value on both lines, or with how many of its values have the change; of more keys
    only the combinations are counted.
    """
    first, last = (pick(found, key=lambda one: order[one.at]) for pick in (min, max))
    start, end = ("from", " on") if all(one.stays for one in found) else ("first at", "")
    early, late = at(first.at), at(last.at)
    not_yet = f" (not yet at {bare(at(first.before), early)})"
    one_place, all_lines = order[first.at] == order[last.at], len(found) == lines
    if len(others) == 1:
        name, beside, of = others[0]["name"], shown_of(others[0]), f"for {len(found)} of {lines} values of "
    else:
        name, beside, of = f"the other {len(others)} keys", None, f"in {len(found)} of {lines} combinations of "
    if one_place:
        with_ = "" if all_lines else f" with {name} {beside(first.at)}" if beside and len(found) == 1 else \
            f", {of}{name},"
        return f"{start} {early}{end}{not_yet}{with_}"
    if beside and all_lines:
        return (f"{start} {early}{end}{not_yet} with {name} {beside(first.at)}, {start} {late}{end} with "
                f"{beside(last.at)},")
    befores = " and ".join(bare(at(one.before), late) for one in (first, last))
    return (f"{start} {bare(early, late)} to {late}{end} (not yet at {befores}), "
            f"{'depending on ' if all_lines else of}{name},")
