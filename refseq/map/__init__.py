"""The map: what is learnt from drives, saved, and localised in."""
