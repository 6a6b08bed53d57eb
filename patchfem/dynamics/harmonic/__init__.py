"""Steady motions by harmonic balance between true turning points, with branches and stability.

Read `harmonic` and `balance` first.
"""
