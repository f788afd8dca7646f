"""Fittings: things that hang on walls or stand against them, but for windows and doors."""

from functools import partial

import mujoco
import numpy as np

from refseq_bench.worlds.arrays import Block
from refseq_bench.worlds.parts import posters, textures
from refseq_bench.worlds.parts.shell import PROUD
from refseq_bench.worlds.parts.site import Site
from refseq_bench.worlds.plans.footprints import OFF_WALL
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import Bin, Board, Cabinet, Fixture, FloorPlan, Material, OnWall, Poster

PAPER = Material(albedo=0.8, roughness=0.7)
CORK = Material(albedo=0.28, roughness=0.9)
ENAMEL = Material(albedo=0.5, roughness=0.4)


def hang_fittings(site: Site, plan: FloorPlan) -> None:
    """Put everything on the walls and against them."""

    def frame(item: OnWall) -> LocalFrame:
        return LocalFrame.of(plan.wall_named(item.wall))

    for poster in plan.poster:
        _poster(site, frame(poster), poster)
    for board in plan.board:
        _board(site, frame(board), board)
    for cabinet in plan.cabinet:
        _cabinet(site, frame(cabinet), cabinet, plan.material[cabinet.material])
    for one in plan.bin:
        _cylinder(site, f"bin:{one.name}", frame(one), one, one.material)
    for fixture in plan.fixture:
        _fixture(site, frame(fixture), fixture)


def _poster(site: Site, frame: LocalFrame, poster: Poster) -> None:
    key = f"poster:{poster.name}"
    size, rng, style = (poster.width, poster.height), site.rng(key), poster.style
    written = style == "whiteboard"
    draw = partial(posters.whiteboard, size, rng) if written else partial(posters.poster, size, style, rng)
    site.panel(key, frame, poster.extent, PROUD, poster.rise, site.picture(key, draw, PAPER))


def _board(site: Site, frame: LocalFrame, board: Board) -> None:
    key = f"board:{board.name}"
    draw = partial(posters.notice_board, (board.width, board.height), board.sheets, site.rng(key))
    site.panel(key, frame, board.extent, 2 * PROUD, board.rise, site.picture(key, draw, CORK))


def _cabinet(site: Site, frame: LocalFrame, cabinet: Cabinet, material: Material) -> None:
    key = f"cabinet:{cabinet.name}"
    site.solid(key, frame, (cabinet.extent, (0.0, cabinet.depth), cabinet.rise), cabinet.material)
    draw = partial(textures.metal, (cabinet.width, cabinet.height), material.albedo, site.rng(key))
    front = site.picture(f"{key}:front", draw, material)
    site.panel(f"{key}:front", frame, cabinet.extent, cabinet.depth + PROUD, cabinet.rise, front)


def _cylinder(site: Site, name: str, frame: LocalFrame, item: Bin | Fixture, material: str) -> None:
    """Stand or hang an upright cylinder."""
    radius, (low, high) = item.width / 2, item.rise
    pos = frame.point(item.at, radius + OFF_WALL, (low + high) / 2)
    site.shape(name, mujoco.mjtGeom.mjGEOM_CYLINDER, pos, [radius, (high - low) / 2, 0.0], material)


def _fixture(site: Site, frame: LocalFrame, fixture: Fixture) -> None:
    key, block = f"{fixture.kind}:{fixture.name}", (fixture.extent, (0.0, fixture.depth), fixture.rise)
    if fixture.kind == "extinguisher":
        _cylinder(site, key, frame, fixture, fixture.material)
        return
    site.solid(key, frame, block, fixture.material)
    if fixture.kind == "radiator" and (fins := _fins(fixture)):  # a narrow one has none
        site.lattice(f"{key}:fins", frame, fins, fixture.material, cast=False)
    if fixture.kind == "sign":
        draw = partial(posters.sign, (fixture.width, fixture.height), site.rng(key))
        material = site.picture(f"{key}:face", draw, ENAMEL)
        site.panel(f"{key}:face", frame, fixture.extent, fixture.depth + PROUD, fixture.rise, material)


def _fins(fixture: Fixture) -> list[Block]:
    pitch, (first, last), (low, high) = 0.06, fixture.extent, fixture.rise
    out = (fixture.depth, fixture.depth + 0.015)
    return [((s, s + 0.035), out, (low + 0.03, high - 0.03)) for s in np.arange(first + 0.02, last - 0.04, pitch)]
