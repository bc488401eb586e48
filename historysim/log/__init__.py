"""The event log: what a history was made from, on disk, and the shortcuts beside it.

`canonical` says what is digested, `head` what a log begins with, `snapshot` how a state is kept, `file` how all of it
stands in one file.
"""

from historysim.log.canonical import digest as digest
