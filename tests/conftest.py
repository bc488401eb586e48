from hypothesis import settings

# the first example of a property may wait for a library to load or for code to be compiled
settings.register_profile("unhurried", settings(), deadline=None)
settings.load_profile("unhurried")
