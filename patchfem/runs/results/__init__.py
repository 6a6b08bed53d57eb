"""Result that every run returns.

In: a `Plan` that was run, and the output of its engine. Out: `Result`, the meaning of every
measure, and notes on neglected effects of the friction law. Read `result`
first.
"""
