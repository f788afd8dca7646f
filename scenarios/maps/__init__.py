"""Maps beside each other: incidence, similarity, joins."""
