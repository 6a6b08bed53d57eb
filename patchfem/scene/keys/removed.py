"""What patchfem 1.0 no longer takes, and what to use instead."""

METHODS = {
    name: f"'{name}' was removed in patchfem 1.0; use 'march' (studies/integrators compares the methods)"
    for name in ("duhamel", "newmark", "euler")
}
LAWS_OVER_GROOVES = ("iwan", "bouc-wen", "lugre")
KEYS = {
    f"accuracy.{name}": f"this key of method '{method}' was removed in patchfem 1.0; use method 'march' without it"
    for name, method in (
        ("convergence", "duhamel"),
        ("convergence_tolerance", "duhamel"),
        ("stick_speed", "newmark"),
    )
}
