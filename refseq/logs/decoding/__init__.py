"""Decoding of pictures, video and packed data, within the limits of what they may declare."""
