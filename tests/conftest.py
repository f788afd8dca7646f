"""What holds for all tests."""

from hypothesis import settings

# An example may take long for the first time, or on a busy machine: no test asserts a time on the wall clock.
settings.register_profile("no-deadline", deadline=None)
settings.load_profile("no-deadline")
