"""Friction laws, one per file; *_kernels modules hold their compiled forms."""
