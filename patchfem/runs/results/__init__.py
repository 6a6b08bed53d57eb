"""Result that every run returns.

In: a `Plan` that was run, and the output of its engine. Out: `Result`, with the meaning of
every measure, and notes on effects of the law and of frictional heating that are neglected.
Read `result` first.
"""
