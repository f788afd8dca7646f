"""Modules of a robot as processes on one or several hosts: they find each other, and a restarted one takes over."""
