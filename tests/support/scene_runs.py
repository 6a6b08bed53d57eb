"""Runs of scenes with changed keys, and comparisons of their measures with references and with other runs."""

import re

from patchfem.runs.run import run
from patchfem.scene import loads

REMEDY = r"\b(add|belongs|built|choose|give|keep|leave|lower|must|name|need|needed|needs|put|raise|set|use)\b"
# Reasons that say themselves what to do.
OWN_REMEDY = "is not above|nothing moves|there is no such file"


def load_scene(text: str, changes: str = "", path="a.toml"):
    """Return the scene of a text; `changes` are assignments as of --set, separated by "; "."""
    return loads(text, path, [part for part in changes.split("; ") if part])


def run_scene(text: str, changes: str = "", path="a.toml", **options):
    """Return the result of a scene with changed keys; options as of `patchfem.runs.run.run`."""
    return run(load_scene(text, changes, path), **options)


def assert_covers(measures, references: dict, doubt: float = 0.0) -> None:
    """Assert that each reference lies within the error of its measure plus a relative doubt of the reference."""
    for name, reference in references.items():
        measure = measures[name]
        difference = abs(measure.value - reference)
        assert difference <= measure.error + doubt * abs(reference), (name, measure, reference)


def assert_agree(first, second, names=None, rel: float | None = None) -> None:
    """Assert that measures of two results agree within the sum of their errors, or within a relative difference.

    names: str, optional
        Names of the measures, separated by spaces; all of the first result if omitted.
    """
    for name in names.split() if names else first:
        one, other = first[name], second[name]
        if one.value is None or other.value is None:
            assert one.value is other.value and one.reason == other.reason, name
            continue
        limit = rel * abs(other.value) + 1e-18 if rel else one.error + other.error + other.floor
        assert abs(one.value - other.value) <= limit, (name, one, other)


def find_sentences(sentences, part: str) -> list[str]:
    """Return the sentences that contain a text."""
    return [sentence for sentence in sentences if part in sentence]


def assert_names_key_and_remedy(message: str) -> None:
    """Assert that a refusal names a key or a table of the scene, and says what to do."""
    text = re.sub(r"^(--set|a\.toml(:\d+)?): ", "", message)
    assert re.search(r"[a-z]+(\.[\w[\]-]+)+|\[[a-z.]+\]|^[a-z]+:", text), message
    assert re.search(f"{REMEDY}|{OWN_REMEDY}", text.split(": ", 1)[-1], re.S), message
