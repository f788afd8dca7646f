"""Checks of cases before the first drive, as far as that can be told without simulating anything."""
