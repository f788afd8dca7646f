"""From measurements to beliefs: the stages over one path, over all of them, and in hindsight."""
