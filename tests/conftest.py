import pytest
from hypothesis import settings

# the first example of a property may wait for a library to load or for code to be compiled
settings.register_profile("thorough", deadline=None, max_examples=500)
# the same examples each time: what a change is tested with does not depend on luck
settings.register_profile("unhurried", deadline=None, max_examples=20, derandomize=True)
settings.load_profile("unhurried")


@pytest.fixture
def alone(monkeypatch):
    """The clock of the tests is a thread that holds no lock of a library: a copy of the process is enough."""
    monkeypatch.setattr("threading.active_count", lambda: 1)
