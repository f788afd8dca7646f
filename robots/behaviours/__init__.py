"""Behaviours that any robot runs: inputs are what it senses, the output is a ``Twist`` (card X1, appendix C)."""

from robots.behaviours.behaviour import Behaviour, Frame, Outcome, Senses, Step

__all__ = ["Behaviour", "Frame", "Outcome", "Senses", "Step"]
