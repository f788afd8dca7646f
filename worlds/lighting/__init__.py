"""Light of a world: what its sources give, what walls send on, and the lights and pictures that renderers get."""
