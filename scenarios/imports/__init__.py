"""Import closure: the files and packages that some Python code can reach, found without importing it."""
