"""Pictures, colours and points of the plane that several tabs draw with."""
