"""The keys that a scene may hold.

Each has a kind, limits and a default (`tables`, `contact`, `types`), a unit (`quantities`) and a meaning in one
sentence (`meanings`); `materials` are known by name. Read `tables` first.
"""
