"""Exact motion under Coulomb friction: series between stops and releases, under any drive.

A drive of constants and sines enters by its phase, a sweep or a record by its local series; a drive far below the modes
by long pieces (`following`). Read `engine` first, then `signals` and `stick_sets`; `sdof` of `one_mode` for one mode.
"""
