"""Free notes of a drive in its recording's metadata (thesis 5.3.1, log parameters)."""

from collections.abc import Mapping

from refseq.errors import LogError

NOTES = "notes"
"""Metadata key."""
LONGEST_NOTES = 4000
"""Characters; a page of writing."""


def checked_notes(text: str) -> str:
    """Notes without blanks around them. Raises ``LogError`` for too many, and for what is no text."""
    found = "\n".join(line.rstrip() for line in text.strip().splitlines())
    if len(found) > LONGEST_NOTES:
        raise LogError(f"notes have {len(found)} characters; valid are up to {LONGEST_NOTES}")
    strange = next((sign for sign in found if not (sign.isprintable() or sign in "\n\t")), None)
    if strange is not None:
        raise LogError(f"notes: {strange!r} is no character of a text; valid are letters, signs and line breaks")
    return found


def noted(text: str) -> Mapping[str, str]:
    """Metadata of notes: nothing where there are none."""
    return {NOTES: found} if (found := checked_notes(text)) else {}
