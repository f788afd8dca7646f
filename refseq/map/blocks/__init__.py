"""Blocks of evidence that only a few places are asked for, beside the words of all of them."""
