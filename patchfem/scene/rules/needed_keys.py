"""Keys that a table lacks, that exclude one another or that have no meaning, as `keys.choices` states them."""

from __future__ import annotations

from ...effects import name_laws_with_key
from ..keys.choices import (
    EQUAL_LENGTHS,
    NEEDS,
    REFUSED_KEYS,
    Need,
    find_choices,
    iterate_tables,
    parse_needs,
)
from .scene_draft import SceneDraft

HINTS = {  # what else a user should know about a missing key
    "mode": "a mass on a spring is a mode with the frequency sqrt(k/m)/(2 pi)",
    "rate": "such as '0.5 Hz/s', or log_rate = '1 oct/min'",
    "spectrum": "a file of a spectrum has the header frequency [Hz],level [g^2/Hz]",
    "onset_length": "such as '0.01 mil'",
    "reading_cutoff": "such as '600 Hz'",
}


def check_needed_keys(draft: SceneDraft) -> None:
    """Report the keys that the tables of a scene lack or exclude; add a remark on each key without meaning."""
    for table_key, table in iterate_tables(draft.tables):
        written = draft.written_value(table_key) or {}
        choices = find_choices(table)

        # Keys that a selector or another key needs.
        for need, is_required, reason in choices.needs:
            used = [bundle for bundle in need.bundles if bundle[0] not in choices.unused]
            _check_need(
                draft, table_key, need._replace(bundles=used), reason, is_required=is_required
            )
        for model, needed_by_key in NEEDS.items():
            for key, words in needed_by_key.items() if isinstance(table, model) else ():
                for need in parse_needs(words) if key in written else ():
                    _check_need(draft, table_key, need, key, is_required=True)

        # Lists with one value for each value of another list.
        for key, other in EQUAL_LENGTHS.get(type(table), {}).items():
            lengths = [len(getattr(table, name) or ()) for name in (key, other)]
            if key not in choices.unused and all(lengths) and lengths[0] != lengths[1]:
                sentence = f"{lengths[0]} values for {lengths[1]} values of `{other}`; give one value for each"
                draft.add_mistake(f"{table_key}.{key}", sentence)

        # Keys without meaning; some of them would be mistaken for an effect, so they are refused.
        for key, reason in choices.unused.items():
            path = f"{table_key}.{key}"
            if key in written and key in REFUSED_KEYS:
                laws = name_laws_with_key(key)
                draft.add_mistake(path, f"{reason} has no key {key}; laws with it are {laws}")
            elif key in written:
                draft.add_remark(path, f"has no meaning for {reason} and is not used")


def _check_need(
    draft: SceneDraft, table_key: str, need: Need, reason: str, *, is_required: bool
) -> None:
    """Report keys of which none is given, or too many."""

    def is_written(key: str) -> bool:
        path = f"{table_key}.{key}"
        return draft.has(path) or path in draft.suggested_keys

    used = [bundle for bundle in need.bundles if any(map(is_written, bundle))]
    if len(used) > 1 and need.is_exclusive:
        second = next(filter(is_written, used[1]))
        draft.add_mistake(
            f"{table_key}.{second}",
            f"`{', '.join(used[0])}` and `{', '.join(used[1])}` exclude each other: keep one",
        )
    elif need.bundles and is_required:
        first, *others = used[:1] or need.bundles
        keys = " or ".join(("this key", *map(", ".join, others)))
        sentence = f"{keys} is needed" if others else ""
        if reason:
            sentence = f"{reason} needs {keys}"
        for key in first:
            if not is_written(key):
                hint = HINTS.get(key, "")
                draft.add_missing(f"{table_key}.{key}", "; ".join(filter(None, (sentence, hint))))
