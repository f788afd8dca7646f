"""Names from outside in drawings: they are drawn as they are written. Imports nothing, so that it costs no start-up."""

from typing import Any

AS_WRITTEN: dict[Any, Any] = {"text.parse_math": False}
"""Settings by which matplotlib does not take what stands between dollars for mathematics."""
