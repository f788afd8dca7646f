"""Floor plans: schema, TOML reading and writing, geometry, generation from a seed."""
