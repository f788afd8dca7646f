"""Folders of pictures as logs."""
