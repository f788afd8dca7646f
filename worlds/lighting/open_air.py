"""Light in the open: one sun that casts shadows, a sky from above and the ground from below, street lamps.

Sky and ground are one image light that lights as an upper half of a sphere with the sky's luminance E / π and a lower
half with the ground's would. What cameras see of the sky is a picture on a dome, which gives the same illuminance and
lights nothing.
"""

from functools import partial

import numpy as np

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.lighting.ambient import Ambient
from refseq_bench.worlds.lighting.colour import camera_weight
from refseq_bench.worlds.lighting.daylight import sun_direction
from refseq_bench.worlds.lighting.form_factors import Cards
from refseq_bench.worlds.lighting.lights import add_image_light, add_spot
from refseq_bench.worlds.lighting.photometry import LAMPS_BELOW, Photometry, outlook
from refseq_bench.worlds.lighting.sky import BEND, HIGHEST, LOWEST, panorama
from refseq_bench.worlds.parts import scenery
from refseq_bench.worlds.parts.facets import grid, show
from refseq_bench.worlds.parts.greyscale import encode
from refseq_bench.worlds.parts.outdoors import ARM, HEAD
from refseq_bench.worlds.parts.site import FRAME, Site
from refseq_bench.worlds.plans.frame import UP, LocalFrame
from refseq_bench.worlds.plans.schema import FloorPlan, Material, Post, Window

DOME = 230.0
"""Radius of the dome that shows the sky [m]: what is drawn on its horizon moves as if it stood so far away."""
DOME_MATERIAL = "built-in:dome"
"""Material of that dome, and its picture."""
DOME_PICTURE = (5120, 768)
"""Size of its picture [px]: 14 pixels a degree around, as many as a camera of 45° and 640 columns has."""
CONE, INNER = np.radians((80.0, 60.0))
"""Half angles of a street lamp's light [rad]: at the inner one it begins to fade, at the outer it ends; a choice."""
REACH = 30.0
"""Range of a street lamp [m]; Filament lets it fade by (1 - (d / REACH)^4)^2."""
LIT_SHARE = 0.2
"""Share of the windows that are lit in the dark; a choice."""
ROOM_LUMINANCE = 120.0
"""Luminance of the brightest thing in a lit room [cd/m²]; a choice."""
FACE_SHARES = np.array([[0.361, 0.642, 0.0], [0.165, 0.671, 0.165], [0.0, 0.642, 0.361]])
"""Illuminance over π of cards that look up, sideways and down (rows) by image light from the upper, the four upright
and the lower faces of luminance 1 (columns); measured in Filament."""
FAINTEST = 1e-6
"""Cards that want less than this share of the brightest one's luminance count as if they wanted so much: black ground
throws none back, and errors of nothing have no share."""
PANE = Material(albedo=0.08, roughness=0.1)


def illuminate_open_air(site: Site, plan: FloorPlan, numbers: Photometry) -> Ambient:
    """Add sky and ground, the street lamps that burn, what is seen of the sky, and window panes; the sun is there.

    Returns the light that the image light should give [lx], the same everywhere.
    """
    _dome(site, plan, numbers)
    _posts(site, plan, numbers)
    for window in plan.window:
        _pane(site, plan, window, numbers)
    return Ambient.even(_sky_and_ground(site, plan, numbers))


# --- sky and ground ---


def _sky_and_ground(site: Site, plan: FloorPlan, numbers: Photometry) -> float:
    """One image light with an upper, a lower and four upright faces; returns what a white one would give [lx]."""
    faces = face_luminances(*outlook(plan, numbers.outdoors))
    peak = float(faces.max())
    above, beside, below = np.round(255 * faces / peak).astype(int).tolist()
    add_image_light(site, "sky", (beside, beside, above, below, beside, beside), peak)
    return np.pi * peak


def face_luminances(above: float, below: float) -> Floats:
    """Luminances [cd/m²] of an image light's upper, upright and lower faces that light as two halves of a sphere would.

    Filament takes each face for one luminance, and what they give a card falls off smoothly. The faces are fitted,
    with equal shares of error, to cards that look up, sideways and down.
    """
    from scipy.optimize import nnls  # half a second to import, which only worlds in the open air wait for

    wanted = np.array([above, (above + below) / 2, below])
    scale = np.maximum(wanted, FAINTEST * wanted.max())
    return np.asarray(nnls(FACE_SHARES / scale[:, None], wanted / scale)[0])


def _dome(site: Site, plan: FloorPlan, numbers: Photometry) -> None:
    """A picture of the sky and the horizon, which glows by itself."""
    low, high = plan.bounds
    beam = sun_direction(numbers.outdoors, plan.place.x_azimuth)
    sun = float(np.arctan2(-beam[1], -beam[0]))
    if site.pictured:
        field = panorama(DOME_PICTURE, numbers.outdoors, sun, plan.place.ground_albedo, site.rng(DOME_MATERIAL))
        peak = float(field.max())
        site.glowing(DOME_MATERIAL, peak, lambda: encode(field / peak, site.rng("built-in:dome:grain")))
    else:
        site.glowing(DOME_MATERIAL, 0.0)
    up = np.radians([-4.0, 0.0, 4.0, 10.0, 16.0, 22.0, 33.0, 45.0, 60.0, 75.0, 89.9])
    around = np.linspace(np.pi, -np.pi, 73)
    azimuth, height = np.meshgrid(around, up)  # (rows, columns)
    level = np.cos(height)
    points = DOME * np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(height)], axis=-1)
    uv = np.stack([0.5 - azimuth / (2 * np.pi), _share(height)], axis=-1)
    show(site, "dome", grid(points + np.append((low + high) / 2, 0.0), uv), DOME_MATERIAL, cast=False)


def _share(up: Floats) -> Floats:
    """Return the place of an elevation [rad] up the picture, 0 to 1."""
    return np.asarray(np.interp(up, [LOWEST, BEND, HIGHEST], [0.0, 0.5, 1.0]))


# --- lamps and windows ---


def axial(post: Post) -> float:
    """Intensity of a street lamp below it [cd].

    Filament's spot has I ((cosθ - o) / (i - o))² between the cosines i and o of its two angles, and I within: its flux
    is 2π I ((1 - i) + (i - o) / 3).
    """
    inner, outer = np.cos(INNER), np.cos(CONE)
    return float(post.lumen / (2 * np.pi * ((1.0 - inner) + (inner - outer) / 3.0)))


def head_of(post: Post) -> Floats:
    """Where its light comes from, (3,) [m]."""
    return LocalFrame.under(post).point(ARM, 0.0, post.height - 0.03)


def post_illuminance(post: Post, cards: Cards) -> Floats:
    """E = I(θ) cosβ / d² of a street lamp on cards, past all that stands there, (m,) [lx]."""
    outer, inner = np.cos([CONE, INNER])
    ray = cards.points - head_of(post)
    d = np.linalg.norm(ray, axis=1)
    cone = np.clip((-ray[:, 2] / d - outer) / (inner - outer), 0.0, 1.0) ** 2
    facing = np.maximum(0.0, -np.einsum("mc,mc->m", ray, cards.normals) / d)
    return np.asarray(axial(post) * cone * facing / d**2)


def _posts(site: Site, plan: FloorPlan, numbers: Photometry) -> None:
    length, width, _ = HEAD
    for post in plan.post:
        name, on = f"post:{post.name}:lamp", post in numbers.lit_posts
        candela = camera_weight(post.kelvin) * axial(post)
        below = ((ARM - length / 2, ARM + length / 2), (-width / 2, width / 2), (post.height - 0.02, post.height))
        glass = site.glowing(name, candela / (length * width)) if on else FRAME
        site.shown(name, LocalFrame.under(post), below, glass)
        if on:
            add_spot(site, name, "lamp", candela, head_of(post), -UP, np.degrees(CONE), 1.0 - INNER / CONE, REACH)


def _pane(site: Site, plan: FloorPlan, window: Window, numbers: Photometry) -> None:
    """Draw a window of a house from outside: dark glass and blinds, or in the dark perhaps a lit room."""
    wall, key = plan.wall_named(window.wall), f"window:{window.name}:view"
    size, rng = (window.width, window.height), site.rng(key)
    lit = rng.random() < LIT_SHARE and numbers.outdoors.ground < LAMPS_BELOW
    if lit:
        site.glowing(key, ROOM_LUMINANCE, partial(scenery.lit_room, size, window.panes, rng))
    else:
        site.picture(key, partial(scenery.window_pane, size, window.panes, rng), PANE)
    site.panel(key, LocalFrame.of(wall), window.extent, 0.055 - wall.thickness, window.rise, key)
