"""Logs written anew: converted, cut, and copied message by message."""
