"""Seeded robustness tests of the command line: scenes and files; every trial is reproducible.

Input: the name of a campaign, a seed and an index. Output: nothing if the program passed, else an exception that says what
it did. A trial passes if every command ends with 0, 2, 3, 4 or 130 and a helpful line, in time, and if the files that it
left are complete. Read `trial` first, then `scenes` as the example of a campaign, then `driver`.
"""
