"""Names of features and of profiles: whoever declares, lists or checks them loads none of what they stand for."""

FEATURE_NAMES = ("sift", "neural", "dense", "walls", "doors", "corners", "boundary", "hu", "sectors")
"""The features that ``refseq.map.extractors`` makes extractors for."""
PROFILE_NAMES = ("thesis", "counting", "best", "neural")
"""The profiles that ``refseq.map.profile`` has."""
ASKING_NETWORK = ("neural",)
"""Profiles that ask a neural network, which not everybody has."""
