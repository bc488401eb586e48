"""The event log: what a history was made from, on disk, and the shortcuts beside it.

`canonical` says what is digested, `header` what a log begins with, `snapshot` how a state is kept, `database` what
SQLite has to do with it, `file` how all of it stands in one file, `replay_start` where a replay of it can begin,
`result` how a result is made of it, and `verification` whether the one is what the other gives. `event_log` is what a
user holds.
"""
