"""Output of a run on the screen: verdict, key numbers in readable units, one line for each file; no output with -q."""

import re
import shlex
from pathlib import Path

import pytest
from command_line import read_json, run_cli
from page_data import find_wrong_numbers

from patchfem.__main__ import VERB_GROUPS, app, register_verbs
from patchfem.export import quantities
from patchfem.scene import read_template

FILE_ENDINGS = {
    ".toml",
    ".csv",
    ".html",
    ".png",
    ".pvd",
    ".uff",
    ".vtu",
    ".json",
}  # of files in examples


def run_template(tmp_path, kind, *words, **keys):
    """Run the template of a kind of scene with settings, and return the answer."""
    path = tmp_path / f"{kind}.toml"
    path.write_text(read_template(kind), "utf-8")
    sets = [f"--set={key.replace('__', '.')}={value}" for key, value in keys.items()]
    return run_cli("run", path, "-o", tmp_path / "out", "--no-page", *sets, *words)


def read_numbers(text: str) -> dict[str, str]:
    """Return the quantities that a command printed, as text by name."""
    lines = [line.split(None, 1) for line in text.splitlines() if line.startswith("  ")]
    return {name: value for name, value in lines}


def test_exact_printed_numbers_equal_summary(tmp_path):
    """Title, verdict, key numbers and files are printed in this order; the numbers equal summary.json."""
    answer = run_template(tmp_path, "rig")
    summary = read_json(tmp_path / "out/summary.json")
    lines = answer.out.splitlines()
    assert lines[0] == summary["title"] == "A rubbing block on flexures, shaken at one frequency"
    count = len(summary["verdict"])
    assert lines[1 : count + 1] == summary["verdict"] and len(lines[1].split()) <= 30
    shown = read_numbers(answer.out)
    assert 3 <= len(shown) <= quantities.MAX_KEY_QUANTITIES
    assert find_wrong_numbers(shown, summary["measures"]) == []
    assert lines[-1] == f"results: {tmp_path / 'out'} (without report.html: --no-page)"
    # the headline has the amplitude with its error
    amplitude = shown["relative_displacement_amplitude"]
    assert f"amplitude at the output {amplitude}" in lines[1]


def test_exact_verbose_run_prints_all_measures(tmp_path):
    """With -v all measures are printed; one without a value has its reason."""
    answer = run_template(tmp_path, "rig", "-v")
    measures = read_json(tmp_path / "out/summary.json")["measures"]
    shown = read_numbers(answer.out)
    assert shown.keys() == measures.keys()
    assert find_wrong_numbers(shown, measures) == []
    missing = {name for name, measure in measures.items() if measure["value"] is None}
    assert all(shown[name] == f"- ({measures[name]['reason']})" for name in missing)
    assert "CPU seconds: " in answer.err


def test_always_missed_tolerance_gives_warning(tmp_path):
    """A measure that misses the tolerance gives a warning with the setting to change."""
    answer = run_template(tmp_path, "bench", accuracy__steps_per_cycle=100)
    # with an empty cache, a line on compilation comes first
    messages = [
        line for line in answer.err.splitlines() if not line.startswith("compiling the code of")
    ]
    assert messages[0].startswith("warning: ") and "set accuracy.steps_per_cycle = " in answer.err
    assert "within the tolerance" not in answer.out


@pytest.mark.parametrize("words, out", [(("-q",), ""), (("-q", "--json"), "{")])
def test_exact_quiet_run_prints_nothing(tmp_path, words, out):
    """A run with -q prints nothing, or only its JSON, and writes its files."""
    answer = run_template(tmp_path, "bench", *words)
    assert answer.code == 0 and answer.err == "" and answer.out[:1] == out
    assert (tmp_path / "out/summary.json").is_file()


def test_exact_results_are_named_if_the_picture_fails(tmp_path):
    """A picture that cannot be written ends a run with code 4, below the line that names its results."""
    answer = run_template(tmp_path, "bench", "--plot", tmp_path / "none/a.png")
    assert answer.code == 4 and "a.png: cannot be written" in answer.err
    assert answer.out.splitlines()[-1].startswith(f"results: {tmp_path / 'out'}")


def test_always_help_has_valid_example_of_every_command():
    """The help lists every command with an example that can be parsed, in lines of at most 80 characters."""
    screen = run_cli().out
    assert screen == run_cli("--help").out and max(map(len, screen.splitlines())) <= 80
    assert [line for line in screen.splitlines() if line in VERB_GROUPS] == [
        "Start",
        "Study",
        "Surfaces",
        "Files",
        "About",
    ]
    for verb, (_, what, example) in (
        (verb, row) for verbs in VERB_GROUPS.values() for verb, row in verbs.items()
    ):
        register_verbs([verb])
        assert f"  patchfem {verb} {example}".rstrip() in screen and what in screen
        read = app.parse_args(
            [verb, *shlex.split(example)], exit_on_error=False, print_error=False
        )[0]
        assert read.__name__.rstrip("_") == verb
        files = [word for word in example.split() if re.fullmatch(r"[\w/]+\.[a-z]+", word)]
        assert {Path(file).suffix for file in files} <= FILE_ENDINGS, example
