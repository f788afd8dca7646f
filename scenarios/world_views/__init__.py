"""Facts and pictures of worlds."""
