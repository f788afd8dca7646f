"""Several paths in one map: similarity, overlap, merging, routes (chapter 4)."""
