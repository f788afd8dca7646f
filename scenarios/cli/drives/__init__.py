"""The commands of single drives: recorded, localised, compared, shown and reported."""
