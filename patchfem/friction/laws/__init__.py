"""Laws of friction, one per file; the compiled form of a law stands beside it as *_kernels."""
