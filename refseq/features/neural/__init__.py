"""Keys that a neural network finds: an option, with a network that the user brings (decision 0046)."""
