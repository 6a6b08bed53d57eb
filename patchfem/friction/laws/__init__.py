"""Friction laws, one per file; the modules named *_kernels contain their compiled forms."""
