"""For all tests: a property that takes long on a busy machine is no failure; pytest's own time limit ends hangs."""

from hypothesis import settings

settings.register_profile("busy", deadline=None)
settings.load_profile("busy")
