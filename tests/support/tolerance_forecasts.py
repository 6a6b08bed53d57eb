"""Scenes with the settings that a plan proposes, and whether a run exceeds its tolerance."""

import patchfem as pf


def cured(text: str, cure: dict) -> str:
    """Return a scene with the proposal of a forecast: keys set, or left out if the value is None."""
    lines = text.splitlines()
    for key, value in cure.items():
        table, _, name = key.rpartition(".")
        at = next(k for k, line in enumerate(lines) if line == f"[{table}]")
        lines = [
            line for k, line in enumerate(lines) if k < at or not line.startswith(f"{name} = ")
        ]
        if value is not None:
            lines.insert(at + 1, f"{name} = {value:.15g}")
    return "\n".join(lines) + "\n"


def misses(text: str) -> bool:
    """Return whether a run of a scene warns that a measure exceeds its tolerance."""
    return any("; the tolerance is " in one for one in pf.run(text).warnings)
