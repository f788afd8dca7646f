"""Guests: processes of their own in which users' localisers run, confined, and their protocol."""
