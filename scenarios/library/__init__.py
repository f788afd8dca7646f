"""The library's scenario files and LAMP programs."""

from pathlib import Path

LIBRARY = Path(__file__).resolve().parent
