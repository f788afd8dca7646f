"""Tasks of the environments: where an episode begins, and the reward of each moment."""
