"""Limits of every size that a file can declare: told in one line before anything of that size is allocated.

Each is far above what a robot's files hold, and far below what a machine with 4 GB of memory can take.
"""

MAP_BYTES = 512 * 2**20
"""Arrays of a map, unpacked [bytes]: some 2 million SIFT words and 10 km of places."""
MAP_HEADER_BYTES = 16 * 2**20
"""Header of a map: profile, metadata, annotations of its paths [bytes]."""
MAP_DIRECTORY_BYTES = 4 * 2**20
"""List of the files in a map's archive [bytes]: some 40 000 arrays."""
MAP_PLACES = 10_000_000
"""Places of a map."""
MAP_FEATURES = 100_000_000
"""Features of a sequence."""
MAP_METRES = 1e9
"""Distances, coordinates and other numbers of a map, either side of 0 [m]: coordinates of the earth are below 1e8."""
BELIEF_BYTES = 512 * 2**20
"""Columns of a table of beliefs, unpacked [bytes]."""
