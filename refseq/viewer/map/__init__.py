"""The tab of a map, a file a panel."""
