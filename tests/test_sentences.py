"""The sentences that a user meets most often, compared with the reviewed list `tests/sentences.toml`.

Other tests ask what a sentence must contain. Here its words are compared, with `#` in place of each number. After a
change of words, `python tests/test_sentences.py` writes the list anew; read the difference before you commit it.
"""

import re
import sys
import tempfile
import tomllib
from pathlib import Path

import pytest

HERE = Path(__file__).parent
LIST = HERE / "sentences.toml"
sys.path[:0] = [str(HERE / "support")] if __name__ == "__main__" else []

from command_line import read_json, run_cli  # noqa: E402
from scene_texts import BENCH, COULOMB, POINT, RIG, SHORT, SMALL_PATCH  # noqa: E402

import patchfem as pf  # noqa: E402
from patchfem.effects import LAWS  # noqa: E402

NUMBER = re.compile(r"(?<![\w.])-?\d+(\.\d+)?(e[+-]?\d+)?")
BLOCK = POINT + COULOMB + SHORT
FILES = {"patch.toml": SMALL_PATCH, "bench.toml": BENCH, "block.toml": BLOCK, "rig.toml": RIG}
STATIC = ("--over", "friction.static=0.1,0.2")
TILTS = ("--over", "contact.tilt.angle=0.001 mrad,0.003 mrad,0.01 mrad,0.03 mrad,0.1 mrad")
DRAWN = ("--over", "friction.static=0.2..0.4", "--over", "normal.load=90 N..110 N", "--sobol", "64")

SCREENS = {  # runs and sweeps whose verdicts are compared
    "patch": ("run", "patch.toml"),
    "bench": ("run", "bench.toml"),
    "block_steady": ("run", "block.toml"),
    "block_stuck": ("run", "block.toml", "--set", "drive.acceleration=1 g"),
    "block_transient": ("run", "block.toml", "--set", "drive.cycles=6"),
    "block_grows": (
        "run",
        "block.toml",
        "--set",
        "drive.acceleration=9 g",
        "--set",
        "structure.mode.0.damping=0",
    ),
    "sweep": ("sweep", "bench.toml", *STATIC),
    "sweep_with_refused_case": ("sweep", "bench.toml", "--over", "normal.load=-1 N,10 N"),
    "sweep_of_tilts": ("sweep", "patch.toml", *TILTS, "--set", "accuracy.tolerance=0.05"),
    "sweep_of_drawn_cases": ("sweep", "bench.toml", *DRAWN),
}
REFUSALS = {
    "unknown_key": ("check", "rig.toml", "--set", "drive.wavform=sine"),
    "unknown_table": ("check", "rig.toml", "--set", "strucure.moving_mass=1 kg"),
    "unknown_unit": ("check", "rig.toml", "--set", "contact.load=26 lb"),
    "no_unit": ("check", "rig.toml", "--set", "contact.load=26"),
    "wrong_kind_of_unit": ("check", "rig.toml", "--set", "contact.load=6 mil"),
    "out_of_range": ("check", "rig.toml", "--set", "friction.static=-0.1"),
    "unknown_law": ("check", "rig.toml", "--set", "friction.law=nonlocl"),
    "unknown_material": ("check", "rig.toml", "--set", "contact.substrate=Ti-8Al"),
    "keys_that_exclude_each_other": ("check", "rig.toml", "--set", "drive.displacement=1 mm"),
    "removed_method": ("check", "block.toml", "--set", "accuracy.method=newmark"),
    "missing_scene": ("run", "none.toml"),
    "missing_results": ("report", "none"),
    "sweep_without_key": ("sweep", "bench.toml"),
    "folder_of_other_files": ("run", "bench.toml", "-o", "."),
    "unknown_export": ("export", "none", "-o", "a.xyz"),
    "unknown_verb": ("rnu", "bench.toml"),
}
WARNINGS = {
    "tolerance_missed": (SMALL_PATCH, {}),
    "coarse_steps": (
        RIG,
        {"accuracy.steps_per_cycle": 40, "contact.element_size": 1e-3, "drive.cycles": 6},
    ),
}


def collect_sentences(folder: Path) -> dict:
    """Return all sentences of the list: {group: {name: text}}."""
    for name, text in FILES.items():
        (folder / name).write_text(text, "utf-8")
    out = {"outcome": {outcome.value: outcome.sentence for outcome in pf.Outcome}}
    out["answer"] = {}
    out["refusal"] = {}
    out["warning"] = {}
    for name, words in SCREENS.items():
        answer = run_cli(*words, "-o", folder / name, "--no-page")
        verdict = read_json(folder / name / "summary.json")["verdict"]
        out["answer"][name] = "\n".join(verdict)
        # the screen shows the same sentences, below the title
        assert out["answer"][name] in answer.out
    for name, words in REFUSALS.items():
        out["refusal"][name] = run_cli(*words).err
    for name, (text, sets) in WARNINGS.items():
        result = pf.run(text, **sets)
        out["warning"][name] = "\n".join(
            [*result.warnings, *(f"note: {note}" for note in result.notes)]
        )
    for texts in out.values():
        for name, text in texts.items():
            texts[name] = replace_numbers(text, folder)
    return out


def replace_numbers(text: str, folder: Path) -> str:
    """Return a text with # for every number, FOLDER for the folder and LAWS for the list of laws."""
    text = text.replace(str(folder), "FOLDER").replace(", ".join(LAWS), "LAWS")
    return NUMBER.sub("#", text).strip()


def write_list(found: dict) -> None:
    """Write the list: one table for each group, one text for each sentence."""
    blocks = [
        "# Sentences of the program, numbers as #; tests/test_sentences.py compares them and writes them.\n"
    ]
    for group, texts in found.items():
        blocks.append(f"\n[{group}]\n")
        blocks += [f"{name} = '''\n{text}'''\n" for name, text in texts.items()]
    LIST.write_text("".join(blocks), "utf-8")


@pytest.fixture(scope="module")
def current_sentences(tmp_path_factory):
    """Return the sentences that the program prints now."""
    folder = tmp_path_factory.mktemp("sentences")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return collect_sentences(folder)


@pytest.mark.parametrize("group", ["outcome", "answer", "refusal", "warning"])
def test_exact_sentences_equal_reviewed_list(current_sentences, group):
    """The sentences of each group equal those of the reviewed list, numbers aside."""
    assert current_sentences[group] == tomllib.loads(LIST.read_text("utf-8"))[group]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place, pytest.MonkeyPatch.context() as context:
        context.chdir(place)
        write_list(collect_sentences(Path(place)))
