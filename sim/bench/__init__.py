"""The bench: one world and one robot, stepped together."""
