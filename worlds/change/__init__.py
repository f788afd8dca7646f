"""Changes of a world between two drives: doors, furniture, posters, cars, pedestrians."""
