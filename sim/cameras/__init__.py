"""Camera models: from luminance to the bytes of an image."""
