"""Steady motions that coexist under a drive, for the tests of harmonic balance."""

from patchfem.dynamics import add_stability, find_steady_motion, list_coexisting_slides


def find_coexisting_motions(modes, drive, group, tolerance: float = 1e-3) -> list:
    """Return the steady motions with their stability, in increasing amplitude of the output."""
    motion = find_steady_motion(modes, drive, group, tolerance=tolerance)
    starts = list_coexisting_slides(motion, drive)
    motions = [find_steady_motion(modes, drive, group, None, tolerance, start) for start in starts]
    motions = [add_stability(motion, modes) for motion in motions]
    return sorted(motions, key=lambda motion: motion.amplitude(modes.output))
