"""What worlds are made of: walls, doors, furniture, cars, people, and how each is drawn."""
