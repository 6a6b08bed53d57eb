"""Scenes with the settings that a plan proposes, and whether a run exceeds its tolerance."""

import patchfem as pf


def apply_proposal(text: str, proposal: dict) -> str:
    """Return a scene with the proposal of a forecast: keys set, or left out if the value is None."""
    lines = text.splitlines()
    for key, value in proposal.items():
        table, _, name = key.rpartition(".")
        table_line = next(k for k, line in enumerate(lines) if line == f"[{table}]")
        lines = [
            line
            for k, line in enumerate(lines)
            if k < table_line or not line.startswith(f"{name} = ")
        ]
        if value is not None:
            lines.insert(table_line + 1, f"{name} = {value:.15g}")
    return "\n".join(lines) + "\n"


def exceeds_tolerance(text: str) -> bool:
    """Return whether a run of a scene warns that a measure exceeds its tolerance."""
    return any("; the tolerance is " in warning for warning in pf.run(text).warnings)
