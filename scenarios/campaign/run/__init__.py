"""Tasks of a campaign and the workers that carry them out."""
