"""Colours of all tabs: Okabe and Ito's, told apart with any colour vision."""

from collections.abc import Mapping, Sequence

from refseq.belief import Stage

Colour = tuple[int, int, int]

TRUTH: Colour = (86, 180, 233)
BELIEVED: Colour = (230, 159, 0)
MATCHED: Colour = (0, 200, 140)
UNMATCHED: Colour = (204, 121, 167)
LOST: Colour = (213, 94, 0)
SCAN: Colour = (0, 158, 115)
WALL: Colour = (240, 228, 66)
DOOR: Colour = (204, 121, 167)
REFERENCE: Colour = (120, 120, 120)
DIM: Colour = (90, 90, 90)
TEXT: Colour = (122, 122, 122)
"""Labels: told apart from a black ground as well as from a white one, 4.3 to one (WCAG 2.2)."""

STAGES: Mapping[str, Colour] = {
    Stage.UNIFORM: (204, 121, 167),
    Stage.PRIOR: (86, 180, 233),
    Stage.CHAIN: (230, 159, 0),
}
OTHERS: Sequence[Colour] = ((0, 158, 115), (240, 228, 66), (0, 114, 178), (213, 94, 0), (220, 220, 220))
"""For what has no colour of its own, one after the other; when they are used up they come again."""


def other(number: int) -> Colour:
    """A colour for the ``number``-th thing that has none of its own."""
    return OTHERS[number % len(OTHERS)]
