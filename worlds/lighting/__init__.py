"""Where light comes from and where it goes: sun and sky, windows and lamps, and what surfaces pass on."""
