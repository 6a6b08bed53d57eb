"""Keys that a table lacks, that exclude one another or that have no meaning, as `keys.choices` states them."""

from ...effects import name_laws_with_key
from ..keys.choices import (
    EQUALLY_LONG_LISTS,
    NEEDED_KEYS,
    REFUSED_KEYS,
    Need,
    find_choices,
    iterate_tables,
    parse_needs,
)
from .facts import TableFacts
from .scene_draft import SceneDraft

MISSING_KEY_HINTS = {  # what else a user should know about a missing key
    "mode": "a mass on a spring is a mode with the frequency sqrt(k/m)/(2 pi)",
    "rate": "such as '0.5 Hz/s', or log_rate = '1 oct/min'",
    "spectrum": "a file of a spectrum has the header frequency [Hz],level [g^2/Hz]",
    "onset_length": "such as '0.01 mil'",
    "reading_cutoff": "such as '600 Hz'",
}


def check_needed_keys(draft: SceneDraft) -> None:
    """Report the keys that the tables of a draft lack or exclude, and add a remark on each key without meaning.

    Which keys a table needs follows from its selectors, such as `law` or `waveform`, from other keys (NEEDED_KEYS), and from
    lists that must have equal lengths.
    """
    for table_key, model_table in iterate_tables(draft.tables):
        table = TableFacts(draft, table_key, model_table)
        choices = find_choices(model_table)

        # Keys that a selector or another key needs.
        for need, is_required, reason in choices.needs:
            # A bundle is a group of keys that stand together, of which the first one decides whether it applies.
            used = [bundle for bundle in need.bundles if bundle[0] not in choices.unused]
            _check_need(table, need._replace(bundles=used), reason, is_required=is_required)
        for model, needed_by_key in NEEDED_KEYS.items():
            for key, word in needed_by_key.items() if isinstance(model_table, model) else ():
                if table.has(key):
                    _check_need(table, parse_needs(word)[0], key, is_required=True)

        # Lists with one value for each value of another list.
        for key, other in EQUALLY_LONG_LISTS.get(type(model_table), {}).items():
            lengths = [len(tuple(table[name])) for name in (key, other)]
            if key not in choices.unused and all(lengths) and lengths[0] != lengths[1]:
                table.add_mistake(
                    key,
                    f"{lengths[0]} values for {lengths[1]} values of `{other}`; give one value for each",
                )

        # Keys without meaning; some of them would be mistaken for an effect, so they are refused.
        for key in filter(table.has, choices.unused):
            reason = choices.unused[key]
            if key in REFUSED_KEYS:
                laws = name_laws_with_key(key)
                table.add_mistake(
                    key, f"{reason} has no key {key}; leave it out; laws with it are {laws}"
                )
            else:
                table.add_remark(key, f"has no meaning for {reason} and is not used")


def _check_need(table: TableFacts, need: Need, reason: str, *, is_required: bool) -> None:
    """Report keys of a table of which none is given, or too many.

    A `need` lists bundles of keys: one bundle must be given if it `is_required`, and only one if they exclude each
    other. `reason` says, in the message, what needs them.
    """

    def is_written(key: str) -> bool:
        """Return whether a key is given, or probably meant by a misspelt one."""
        return table.has(key) or f"{table.table_key}.{key}" in table.draft.suggested_keys

    used = [bundle for bundle in need.bundles if any(map(is_written, bundle))]
    if len(used) > 1 and need.is_exclusive:
        table.add_mistake(
            next(filter(is_written, used[1])),
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
                table.add_missing(
                    key, "; ".join(filter(None, (sentence, MISSING_KEY_HINTS.get(key))))
                )
