"""Rigs behind elastic-plastic elements, exactly from yield to yield.

In: a Model, its Numerics and its solved patch. Out: the Solution of `run`; `costs` has where the march is cheaper.
"""
