"""The atlas tab, a file a panel."""
