"""Valid range of each parameter of a profile, as a declared table: what a map file may ask of memory and arithmetic.

Ends belong to a range. They are wide: a profile within them need not be good, but it answers with probabilities.
"""

from collections.abc import Mapping
from types import MappingProxyType

Range = tuple[float, float]

ANGLE: Range = (0.0, 3.15)
"""Up to half a turn [rad]."""
LENGTH: Range = (0.0, 1e4)
"""Lengths in a scan or along a path [m]."""
SHARE: Range = (0.0, 1.0)
UNSURE: Range = (1e-6, 1 - 1e-6)
"""Probability of a symbol that every state shows now and then: were it 0 or 1, a view could be impossible."""
POSITIVE: Range = (1e-6, 1e6)

RANGES: Mapping[str, Mapping[str, Range]] = MappingProxyType(
    {
        "sift": {
            "cap": (1, 100_000),
            "contrast": (0.0, 1.0),
            "alias_distance": (0.0, 1e6),
            "first_octave": (-1, 20),
            "last_octave": (-1, 20),
            "exact_up_to": (0, 10**9),
        },
        "neural": {
            "cap": (1, 100_000),
            "floor": (0.0, 1e6),
            "alias_distance": (0.0, 2.0),
            "width": (16, 4096),
            "height": (16, 4096),
            "exact_up_to": (0, 10**9),
        },
        "dense": {
            "width": (16, 4096),
            "columns": (1, 256),
            "rows": (1, 256),
            "patch": (1.0, 1000.0),
            "middle": (1, 4096),
            "contrast": (0.0, 256.0),
            "codes": (1, 64),
            "among": (2, 128),
            "seed": (0, 2**32 - 1),
        },
        "walls": {
            "gap": LENGTH,
            "angle": ANGLE,
            "points": (2, 10_000),
            "noise": LENGTH,
            "reach": LENGTH,
            "tilt": ANGLE,
            "offset": LENGTH,
            "length": LENGTH,
        },
        "doors": {
            "narrow": LENGTH,
            "wide": LENGTH,
            "margin": POSITIVE,
            "edge": LENGTH,
            "wall": LENGTH,
            "jamb": LENGTH,
            "support": POSITIVE,
            "side": LENGTH,
            "tilt": (1e-6, 3.15),
            "recess": LENGTH,
            "thickness": LENGTH,
            "clearance": LENGTH,
            "depth": LENGTH,
            "probability": SHARE,
        },
        "hu": {"floor": (1e-300, 1.0), "alias_distance": (0.0, 1e6)},
        "sectors": {"sectors": (1, 3600), "bins": (1, 1000), "nearest": (1e-3, 1e4), "growth": (1.001, 100.0)},
        "mixture": {
            "cost": (1e-6, 1.0),
            "visible": (0.5, 1.0),
            "invisible": (0.5, 1.0),
            "limit": (0.0, 0.5),
            "components": POSITIVE,
            "most": (1, 100_000),
            "from_views": SHARE,
            "tolerance": (0.0, 1e6),
            "iterations": (1, 1000),
        },
        "log_ratio": {
            "blind": SHARE,
            "apart": LENGTH,
            "views": (1, 100_000),
            "scores": (1, 10**8),
            "scans": (0, 1000),
            "scans_alone": (0, 1000),
            "screened": (0, 100_000),
            "geometry": (0, 1000),
            "turns": LENGTH,
            "usual": (0, 10_000),
            "fixes": (0, 1000),
            "tail": (0.0, 100.0),
        },
        "motion": {
            "slack": LENGTH,
            "drift": (0.0, 100.0),
            "tail": SHARE,
            "regularisation": SHARE,
            "odometer_scale": SHARE,
        },
        "chain": {
            "window": (1, 10_000),
            "lost": SHARE,
            "lost_per_metre": (0.0, 1e4),
            "run_out": LENGTH,
            "stay_lost": SHARE,
            "lost_at_start": SHARE,
            "kidnap_probability": SHARE,
            "carried": (0.0, 0.5),
            "vague": (0.0, 0.99),
            "relocalisation_range": (1e-3, 1e3),
            "noise": (1e-12, 1.0),
            "lost_view_entropy": (0.0, 10.0),
            "lost_view_at_place": UNSURE,
            "lost_view_at_lost": UNSURE,
        },
    }
)
"""Range of each number of a profile, by part and name."""
