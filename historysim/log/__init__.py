"""The event log: what a history was made from, on disk, and the shortcuts beside it.

`canonical` says what is digested, `head` what a log begins with, `snapshot` how a state is kept, `file` how all of it
stands in one file, `starts` where a replay of it can begin, `result` how a result is made of it, and `verification`
whether the one is what the other gives. `event_log` is what a user holds.
"""
