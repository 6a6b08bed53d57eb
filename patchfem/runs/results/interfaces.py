"""Pressed interfaces of a run: the patch of [contact], or those of the interfaces of a rig.

In: solved patches. Out: `PressedFace`s, and findings that name the interfaces to which they belong.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ...core import Outcome, add_interface_number, max_abs
from ...effects import law_has_trait
from ...formatting import format_length
from .result import AccuracyFinding, patch_surface


def depends_on_pressure(keys, patch_model) -> bool:
    """Return whether the motion of an interface follows from the pressure at each place, and not from its load alone.

    It does if the patch slips part by part, if the lower piece has the pressure, and if the law averages the pressure.
    `keys` are the effective keys of the law, and `patch_model` is the PatchModel of the interface.
    """
    is_fixed = patch_model.gap.side == "upper" and not law_has_trait(keys.law, "averaged")
    return bool(patch_model.interface.partial_slip) or not is_fixed


class PressedFace(NamedTuple):
    """Pressed interface of a run, on several meshes.

    - number: index of the interface.
    - name: nodes of the interface as the scene writes them, "1-0"; "" for the table [contact].
    - model: model of the run whose patch and friction law are those of this interface.
    - patches: the solved Patch and those on coarser meshes; None for a missing one.
    - fields: frames of the interface by name (see `Result`); None before its run.
    - unworn: the patch before wear, from fine to coarse; () without wear.
    """

    number: int
    name: str
    model: object
    patches: Sequence
    fields: dict | None = None
    unworn: Sequence = ()

    @property
    def patch(self):
        """Patch of the interface, solved on the finest mesh."""
        return self.patches[0]

    @property
    def surface(self):
        """Points of the interface at which its fields are given, with pressure and gap (`press.Surface`)."""
        return patch_surface(self.patch, self.fields or {})

    @property
    def folder(self) -> str:
        """Name of the subfolder of the interface in the output of a run."""
        return self.name.replace(" (", "_").removesuffix(")")

    def name_measure(self, name: str) -> str:
        """Return the name of a measure of this interface in the run, which has its number from the second one on."""
        return add_interface_number(name, self.number)

    @property
    def partial_slip(self) -> str:
        """Scene key that enables partial slip of the patch; "" if the patch slips as a whole."""
        return self.model.patch.interface.partial_slip

    @property
    def depends_on_pressure(self) -> bool:
        """Whether the motion follows from the pressure at each place, so that it has an error due to the mesh."""
        return depends_on_pressure(self.model.friction, self.model.patch)

    def slide(self, response) -> np.ndarray:
        """Return the relative displacement (k,) [m] of the interface in a Response."""
        return response.slides[:, self.number] if self.name else response.slide


def merge_sentences(
    model, faces: Iterable[PressedFace], list_sentences: Callable[[PressedFace], Iterable[str]]
) -> list[str]:
    """Merge sentences that are equal for several interfaces, and name these interfaces.

    Parameters
    ----------
    model : Model
        Model of the run.
    faces : iterable of PressedFace
        Pressed interfaces of the run.
    list_sentences : callable
        Function that returns the sentences on a PressedFace.
    """
    findings = merge_findings(model, faces, lambda face: map(AccuracyFinding, list_sentences(face)))
    return [finding.words for finding in findings]


def merge_findings(
    model,
    faces: Iterable[PressedFace],
    list_findings: Callable[[PressedFace], Iterable[AccuracyFinding]],
) -> list[AccuracyFinding]:
    """Merge findings that are equal for several interfaces, and name these interfaces.

    Scene keys are written as they occur in the scene.

    Parameters
    ----------
    model : Model
        Model of the run.
    faces : iterable of PressedFace
        Pressed interfaces of the run.
    list_findings : callable
        Function that returns the findings on a PressedFace.
    """
    names_by_finding: dict[AccuracyFinding, list[str]] = {}
    for face in faces:
        for finding in list_findings(face):
            words, advice = finding
            if advice is not None:
                text = replace_contact_keys(model, advice.text)
                advice = advice._replace(text=text, key=replace_contact_keys(model, advice.key))
            merged = AccuracyFinding(replace_contact_keys(model, words), advice)
            names_by_finding.setdefault(merged, []).append(face.name)
    findings = []
    for finding, names in names_by_finding.items():
        # The table [contact] has no name.
        place = f"interface{'s' * (len(names) > 1)} {', '.join(names)}: " if names[0] else ""
        findings.append(finding._replace(words=place + finding.words))
    return findings


def replace_contact_keys(model, text: str) -> str:
    """Replace keys of [contact] in a sentence by those of the interface in the scene.

    In a model without [contact], they are keys of [structure.interface.contact].
    """
    if model.patch is not None:
        return text
    return re.sub(r"(?<![\w.])contact\.(?=[a-z])", "structure.interface.contact.", text)


# Largest ratio of displacement to contact length at which the unchanged pressure is accurate.
MAX_SLIDE_TO_LENGTH_RATIO = 0.1


def find_max_displacement(slide) -> float:
    """Return the largest |displacement| [m] of samples (k,); inf if the motion overflowed."""
    largest = max_abs(slide)
    return largest if np.isfinite(largest) else np.inf


def measure_contact_length(patch) -> float:
    """Return the distance [m] between the outermost contact edges of a patch."""
    # The cells of a face share their positions along x.
    x = np.unique(patch.x)
    loaded_nodes = np.unique(np.searchsorted(x, patch.x[patch.active]))
    if not loaded_nodes.size:
        return 0.0
    middle = (x[1:] + x[:-1]) / 2
    ends = np.concatenate([x[:1], middle, x[-1:]])
    return float(ends[loaded_nodes[-1] + 1] - ends[loaded_nodes[0]])


def warn_of_large_slide(patch, slide) -> list[str]:
    """Return a list with a warning if the displacement is large compared with the contact length.

    `slide` (k,) [m] is the relative displacement.
    """
    largest = find_max_displacement(slide)
    contact = measure_contact_length(patch)
    if not contact > 0 or largest < MAX_SLIDE_TO_LENGTH_RATIO * contact:
        return []
    return [
        f"the slide amplitude, {format_length(largest, 3)}, is {largest / contact:.2g} of the "
        f"contact length {format_length(contact)} "
        f"(limit {MAX_SLIDE_TO_LENGTH_RATIO:g}): the computation keeps the pressure unchanged and "
        "neglects that the ends of the pieces "
        "no longer overlap"
    ]


def check_pieces_overlap(outcome, patch_model, patch, slide):
    """Return LEAVES_CONTACT if one piece slides off the other, else the given outcome.

    Parameters
    ----------
    outcome : Outcome or None
        Outcome if the pieces overlap throughout.
    patch_model : PatchModel
        Patch with the length of the pieces; None without one.
    patch : Patch or None
        None for [normal], which has no length.
    slide : (k,)
        Relative displacement [m].
    """
    if patch is None:
        return outcome
    pieces = patch_model.pieces
    mean_length = (pieces.lower.length + pieces.upper.length) / 2
    # The displacement of a motion that did not converge has no meaning.
    if find_max_displacement(slide) > mean_length and outcome is not Outcome.NOT_CONVERGED:
        return Outcome.LEAVES_CONTACT
    return outcome
