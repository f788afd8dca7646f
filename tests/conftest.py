"""What holds for all tests."""

import signal

from hypothesis import settings

# An example may take long for the first time, or on a busy machine: no test asserts a time on the wall clock.
# Each run draws other examples: many runs of a few find what one of many does. The nightly one draws many.
settings.register_profile("quick", deadline=None, max_examples=25)
settings.register_profile("thorough", deadline=None, max_examples=400)
settings.load_profile("quick")

# A shell without job control lets what it starts in the background ignore Ctrl-C, and children inherit that: those that
# tests start and interrupt would go on.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
