"""The files that a localiser of one's own begins with."""

from pathlib import Path

MY_LOCALISER = {suffix: Path(__file__).with_name(f"my_localiser{suffix}") for suffix in (".py", ".cpp")}
"""By the ending of its name: a class in Python, a program in C++."""
