"""The renderer that bakes: the light of all that stands still is worked out once, pictures only look it up."""
