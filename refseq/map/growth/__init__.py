"""Growth of a map: later drives as further experiences of its places."""
