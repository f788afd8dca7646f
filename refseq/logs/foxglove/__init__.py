"""MCAP files with Foxglove's schemas: writing the bench's own, reading anybody's."""
