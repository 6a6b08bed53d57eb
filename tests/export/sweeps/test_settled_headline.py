"""Headline of a sweep of which a single case has settled."""

import json

from command_line import run_cli
from scene_texts import COULOMB, POINT, SHORT


def test_exact_headline_of_one_settled_case_states_no_change(tmp_path):
    """Of two cases one sticks and the other has not settled, so that the headline knows no change."""
    (tmp_path / "rig.toml").write_text(POINT + COULOMB + SHORT, encoding="utf-8")
    words = ("--over", "friction.static=0.01,5", "--set", "drive.cycles=2", "-o", tmp_path / "out")
    run_cli("sweep", tmp_path / "rig.toml", *words)
    headline = json.loads((tmp_path / "out/summary.json").read_text("utf-8"))["verdict"][0]
    assert headline == "Only one of 2 cases has settled, so that no change is known."
