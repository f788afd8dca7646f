"""Survey of a world: its facts, snapshots along a route, and how a place looks over the day."""
