"""The keys that a scene may hold.

Each has one record: kind, limits, meaning and default (`tables`, `contact`, `accuracy`, made of `types`); the units of
a kind stand in `quantities`; `materials` are known by name. Read `tables` first.
"""
