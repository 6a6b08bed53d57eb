"""Every property test of the suite: no deadline per example, so that a busy machine fails nothing."""

from hypothesis import settings

settings.register_profile("patchfem", deadline=None)
settings.load_profile("patchfem")
