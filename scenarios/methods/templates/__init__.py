"""The file that a localiser of one's own begins with."""

from pathlib import Path

MY_LOCALISER = Path(__file__).with_name("my_localiser.py")
