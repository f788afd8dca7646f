"""Sizes of maps: places, features, and the bytes of the file."""

from collections.abc import Mapping
from dataclasses import dataclass

from refseq.map.map import Map
from refseq_bench.scenarios.tables import TextTable


@dataclass(frozen=True, slots=True)
class MapSize:
    """Numbers of a map; ``distinct`` is that of places which show features of their own."""

    places: int
    distinct: int
    features: int
    bytes: int


def size_of(map_: Map) -> MapSize:
    """The size of a map, whose places all count as distinct."""
    features = sum(sequence.matrix.N for sequence in map_.sequences)
    return MapSize(len(map_), len(map_), features, len(map_.to_bytes()))


def size_table(sizes: Mapping[str, MapSize]) -> TextTable:
    """Sizes by the names of files, a row each."""
    table = TextTable("map", ">places", ">told apart", ">features", ">bytes")
    for name, size in sizes.items():
        table.add_row(name, *(str(number) for number in (size.places, size.distinct, size.features, size.bytes)))
    return table
