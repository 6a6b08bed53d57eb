"""Exact motion under Coulomb friction: closed form between stops and releases.

Read `engine` first, then `sdof` for one mode.
"""
