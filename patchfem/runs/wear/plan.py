"""What the cycles of wear cost, before anything runs."""

PRESSED = 20  # contact solves in a jump with its corrections
SOLVE = 1.2e-8  # s per squared interface point of one of them, and of the measures after it


def jumps_about(model) -> int:
    """Number of jumps; an automatic run takes some 12 at a tolerance of 1e-2, 25 to 65 at 1e-3."""
    return model.wear.jumps or int(6 * model.accuracy.tolerance**-0.25)


def _anew(model) -> bool:
    """Whether wear changes the motion."""
    return bool(model.soft) or model.side == "lower" or model.grooves is not None


def cost(model, points: int, motion: float) -> float:
    """Seconds of all jumps on a patch of so many interface points; motion: of the march or the bench with its coarser
    runs, of which a jump takes one."""
    again = motion / 2 if _anew(model) else 0.0
    return jumps_about(model) * (PRESSED * SOLVE * points**2 + 5e-3 + again)


def verdict(model) -> str:
    """A sentence on the jumps and on what they share."""
    motion = "with the motion found anew after each" if _anew(model) else \
        "with one motion for all, as wear does not change it"
    many = f"{model.wear.jumps} jumps" if model.wear.jumps else f"about {jumps_about(model)} jumps, chosen on the way,"
    return f"wear: {model.wear.cycles:.6g} cycles in {many} {motion}"
