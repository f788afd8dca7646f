"""The page of missions: choose a map, state a goal and tasks on it, run the mission, watch it (5.3.2)."""
