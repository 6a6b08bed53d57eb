"""The law bench: a prescribed slide in, the loop out.

Read `bench` first.
"""
