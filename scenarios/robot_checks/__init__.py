"""Facts, checks and pictures of robots."""
