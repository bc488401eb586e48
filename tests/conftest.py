from hypothesis import settings

# the first example of a property may wait for a library to load or for code to be compiled
settings.register_profile("thorough", deadline=None, max_examples=500)
# the same examples each time: what a change is tested with does not depend on luck
settings.register_profile("unhurried", deadline=None, max_examples=20, derandomize=True)
settings.load_profile("unhurried")
