"""Modules of a robot that know its body: the bench that plays it, and the Control layer."""
