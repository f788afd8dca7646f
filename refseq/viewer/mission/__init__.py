"""The mission tab and what is kept of a mission for it."""
