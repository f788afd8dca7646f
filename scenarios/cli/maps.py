"""The commands ``refseq learn`` and ``refseq map add | merge | compact | similarity | plan | route`` and others."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.map_add import ADD_HELP, add
from refseq_bench.scenarios.cli.terminal.console import err, out, print_json, wrote
from refseq_bench.scenarios.cli.terminal.merged import tell_merged
from refseq_bench.scenarios.cli.terminal.options import (
    LOG_KINDS,
    Features,
    Json,
    MapFile,
    NoisySelection,
    Profile,
    QueryFile,
    Seed,
    Sensors,
    defaulting,
    flag,
    grouped,
    option,
)
from refseq_bench.scenarios.cli.terminal.outputs import (
    ARRAYS,
    CHART,
    DECISIONS,
    MAP_TO_WRITE,
    PAGE,
    file_to_write,
)
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, group
from refseq_bench.scenarios.drives.inputs import check_output, read_drive, read_map, replacement, words
from refseq_bench.scenarios.drives.learnt_views import learnt_notes
from refseq_bench.scenarios.errors import ScenarioError, about
from refseq_bench.scenarios.tables import plural, say

if TYPE_CHECKING:
    from refseq.atlas.decision import Decision

BELOW = 1

LEARN_HELP = """Examples:

* `refseq learn reference.mcap -o map.refseq`
* `refseq learn reference.mcap --sensors camera-1 -o one-camera.refseq`
* `refseq learn reference.mcap --most-informative 1000 -o small.refseq`
* `refseq learn robot.log --views 0:160 --thin 0.5 --profile best -o laser.refseq`"""

app = group("Merge, compact and compare maps, find routes in them, look into them.")

app.command("add", cls=BenchCommand, epilog=ADD_HELP)(add)

MIN_OVERLAP = option(
    "METRES",
    "Shortest stretch that is joined by itself; from 0.6 of it on with the support of other joins.",
    min=0,
    max=1000,
)


@grouped
def learn(
    recording: Annotated[Path, typer.Argument(metavar="RECORDING", help=f"First drive: {LOG_KINDS}")],
    output: Annotated[Path, MAP_TO_WRITE],
    sensors: Sensors = None,
    profile: Profile = "thesis",
    features: Features = None,
    most_informative: Annotated[
        int | None, option("N", "Keep the N words that tell most about the place. [default: all]", min=1)
    ] = None,
    seed: Seed = 1,
    selection: NoisySelection = NoisySelection(),
) -> None:
    """Learn a map, a reference sequence, from a first drive."""
    from refseq.map.profile import profile_named

    check_output(output, of=[recording, *selection.chosen().files])
    chosen, wanted, extracted = profile_named(profile), words(sensors, "sensors"), words(features, "features")
    drive = read_drive(recording, selection.with_noise(seed), wanted)

    from refseq.map.learning import learn as learn_map

    with about(recording):
        map_ = learn_map(
            drive.views,
            sensors=wanted,
            features=extracted,
            profile=chosen,
            metadata=learnt_notes(recording, drive.metadata, selection.chosen()),
            most_informative=most_informative,
        )
    if not map_.sequence.matrix.N:
        raise ScenarioError(
            f"{recording}: no feature is found in what {', '.join(sorted(map_.sensors))} sees; valid are larger "
            "pictures, or other --features: dense for small ones"
        )
    map_.save(output)
    say(
        out,
        f"{output}: {plural(len(map_), 'place')} over {map_.paths[0].length:.1f} m, "
        f"{plural(map_.sequence.matrix.N, 'feature')} of {', '.join(sorted(map_.sensors))}",
    )


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq map merge east.refseq west.refseq -o whole.refseq`
* `refseq map merge whole.refseq north.refseq -o larger.refseq --write-decisions joins.toml`
* `refseq map merge east.refseq west.refseq -o whole.refseq --page joins.html --recordings drives`
* `refseq map merge whole.refseq -o whole.refseq --decisions joins.toml`""",
)
def merge(
    maps: Annotated[list[Path], typer.Argument(metavar="MAP", help="Maps to merge, merged ones among them.")],
    output: Annotated[Path, MAP_TO_WRITE],
    decisions: Annotated[Path | None, option("FILE", "Joins that a person made or refused (.toml).")] = None,
    write_decisions: Annotated[
        Path | None, file_to_write(DECISIONS, "Joins made and refused, with the reasons, to write")
    ] = None,
    page: Annotated[
        Path | None, file_to_write(PAGE, "Page to look at the joins and to decide about them, to write")
    ] = None,
    recordings: Annotated[
        list[Path] | None,
        option(
            "FILE",
            "Recording of a map, or a folder of them, for the page's pictures; may be repeated.",
        ),
    ] = None,
    confirm: Annotated[bool, flag("--confirm", "Ask about every join on the terminal.")] = False,
    min_overlap: Annotated[float | None, defaulting(MIN_OVERLAP, "that of the merged MAPs, 5 without one")] = None,
    keep_joins: Annotated[
        bool, flag("--keep-joins", "Add to the first map as it is, without the maps that it was made of.")
    ] = False,
) -> None:
    """Merge maps to one of several paths, which share the places that they have in common; find where a path loops.

    A map that was merged before is taken apart into the maps that it was made of, which have to be where they were: so
    all joins are decided about anew, and the order of merging changes nothing. A person's decisions stay, and so does
    --min-overlap.
    """
    from refseq_bench.scenarios.maps import joins, members
    from refseq_bench.scenarios.maps.checks import check_agreeing, check_made, in_order, read_maps

    _check_merge_files(output, write_decisions, page, recordings or [])
    replacing = replacement(output, maps)
    parts = members.TakenApart(maps, [], {}) if keep_joins else members.with_members(maps)
    files, least = parts.files, parts.min_overlap(min_overlap)
    # A map that was merged before may be replaced: its members stay.
    check_output(output, write_decisions, page, of=files)
    given = joins.read_decisions(decisions) if decisions else joins.GivenDecisions([], [])
    check_agreeing(given.persons)
    asked = members.newest(given.persons, parts.decisions)
    read = read_maps(files, asked, given.machines, loaded=parts.loaded)
    wishes = in_order(asked, read)

    from refseq.atlas.decision import leave_it
    from refseq.atlas.merge import merge_maps
    from refseq_bench.scenarios.maps.merge_notes import merge_notes

    merged = merge_maps(read, members.overlap_settings(least), ask if confirm else leave_it, wishes)
    check_made(merged.decisions, joins.BY_A_PERSON)
    whole = members.with_record(merged, read, files, output, wishes, least)
    with replacing:
        if write_decisions is not None:
            joins.write_decisions(write_decisions, merged.decisions)
        if page is not None:
            from refseq_bench.scenarios.maps.joins_page import write_joins_page

            write_joins_page(page, merged, f"Joins of {output.name}", read, recordings or [])
        whole.save(output)
    tell_merged(merged, merge_notes(merged, read, given.machines), sum(map(len, read)), whole, output)


def _check_merge_files(output: Path, decisions: Path | None, page: Path | None, recordings: list[Path]) -> None:
    """Tell before the work begins which files do not fit each other."""
    from refseq_bench.scenarios.maps.view_pictures import check_recordings

    check_output(output, decisions, page)
    if recordings and page is None:
        raise ScenarioError("--recordings has pictures for the page of --page; valid is to ask for that as well")
    check_recordings(recordings)


def ask(decision: "Decision") -> "Decision":
    """Ask on the terminal whether a join is right; an empty answer leaves it as it is."""
    from refseq_bench.scenarios.maps.joins import BY_A_PERSON

    say(
        out,
        f"{decision.one} views {decision.first[0]}-{decision.first[1]} and {decision.other} views "
        f"{decision.second[0]}-{decision.second[1]}, {decision.lengths[0]:.1f} and {decision.lengths[1]:.1f} m: "
        f"{decision.why}",
    )
    joined = typer.confirm("join them?", default=decision.joined)
    return decision if joined is decision.joined else replace(decision, joined=joined, why=BY_A_PERSON)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq map compact map.refseq -o small.refseq`
* `refseq map compact map.refseq --alike 0.8 --within 3 -o smaller.refseq`""",
)
def compact(
    map_file: MapFile,
    output: Annotated[Path, MAP_TO_WRITE],
    alike: Annotated[
        float,
        option("SHARE", "Join places that differ by at most this share of what places far apart do.", min=0, max=1),
    ] = 0.5,
    within: Annotated[float, option("METRES", "Join no places that are farther apart along the path.", min=0)] = 2.0,
    as_json: Json = False,
) -> None:
    """Make neighbouring places that cannot be told apart show the same, and forget the words that none shows."""
    from refseq.map.compact import compact as compact_map
    from refseq_bench.scenarios.maps.sizes import size_of, size_table

    check_output(output, of=[map_file])
    whole = read_map(map_file)
    made = compact_map(whole, alike, within)
    told = f"places at most {alike:g} apart, within {within:g} m"
    small = made.map.noted({"compacted": told})
    before, after = size_of(whole), replace(size_of(small), distinct=sum(map(len, made.runs)))
    small.save(output)
    if as_json:
        print_json({"before": before, "after": after})
        return
    out.print(size_table({map_file.name: before, output.name: after}))
    say(
        out,
        f"{output}: {after.distinct} of {after.places} places are told apart, "
        f"{100 * after.bytes / before.bytes:.0f} % of the bytes",
    )


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq map similarity east.refseq west.refseq`
* `refseq map similarity east.refseq west.refseq -o alike.png --arrays alike.npz`""",
)
def similarity(
    one: MapFile,
    other: Annotated[Path, typer.Argument(metavar="OTHER", help="Map to compare with.")],
    output: Annotated[Path | None, CHART] = None,
    arrays: Annotated[Path | None, file_to_write(ARRAYS, "Both matrices to write, there and back")] = None,
    min_overlap: Annotated[float, MIN_OVERLAP] = 5.0,
    as_json: Json = False,
) -> None:
    """Compare the views of two maps, and tell the stretches that they share; nothing is merged."""
    from refseq_bench.scenarios.maps.checks import read_maps

    check_output(output, arrays, of=[one, other])
    first, second = read_maps([one, other], first_of_one_path=True)

    from refseq.atlas.merge import merge_maps
    from refseq.atlas.overlap import OverlapSettings
    from refseq_bench.scenarios.maps.joins import decision_table
    from refseq_bench.scenarios.maps.similarity import similarity_of, write_arrays

    every = merge_maps([first, second], OverlapSettings(least=min_overlap)).decisions
    decisions = [decision for decision in every if decision.one != decision.other]
    if as_json:
        print_json(decisions)
    elif decisions:
        out.print(decision_table(decisions))
    else:
        say(out, "no view of one leads to the other and back")
    if arrays is None and output is None:
        return
    matrices = similarity_of(first, second)
    if arrays is not None:
        with wrote(arrays, quiet=as_json):
            write_arrays(arrays, matrices)
    if output is not None:
        from refseq_bench.scenarios.maps.drawings.similarity import draw

        with wrote(output, quiet=as_json):
            draw(output, matrices, decisions)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq map plan whole.refseq -o plan.png`
* `refseq map plan whole.refseq --json`
* `refseq map plan whole.refseq -o plan.png --floor building.png --at 0=120,340 --at 57=800,335 --at west:9=805,90`""",
)
def plan(
    map_file: MapFile,
    output: Annotated[Path | None, CHART] = None,
    floor: Annotated[Path | None, option("PICTURE", "Picture of a floor plan to draw the paths on, with --at.")] = None,
    at: Annotated[
        list[str] | None,
        option(
            "PLACE=X,Y",
            "Pixel of the floor plan, from its top left, that a place lies at, by its number or PATH:VIEW; three times "
            "or more.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Draw the paths of a merged map where joins and odometry put them, and tell the error where truth is known."""
    from refseq_bench.scenarios.maps.floor_plan import check_asked, lay_floor
    from refseq_bench.scenarios.maps.plan import check_plan, plan_error

    check_asked(floor, at or [])
    check_output(output, of=[map_file, floor])
    map_ = read_map(map_file)
    check_plan(map_, map_file)

    from refseq.atlas.sharing import loops_of

    laid_on = lay_floor(floor, at or [], map_) if floor is not None else None
    error = plan_error(map_)
    laid = [path.name for path in map_.paths if len(path.poses)]
    apart = [path.name for path in map_.paths if not len(path.poses)]
    if as_json:
        ends = [(path.name, run[[0, -1]].T.tolist()) for path in map_.paths for run in loops_of(path)]
        loops = [{"path": name, "first": first, "second": second} for name, (first, second) in ends]
        drawn_on = laid_on and {"fit": laid_on.fit, "marks": laid_on.marks}
        print_json({"paths": laid, "apart": apart, "loops": loops, "error": error, "floor": drawn_on})
    else:
        say(out, f"{plural(len(laid), 'path')} in one frame: {', '.join(laid)}")
        if apart:
            say(out, f"not joined to them: {', '.join(apart)}")
        for path in map_.paths:
            for (first, last), (again, until) in (run[[0, -1]].T.tolist() for run in loops_of(path)):
                say(out, f"{path.name} comes back to itself: views {again} to {until} are at {first} to {last}")
        if error is not None:
            say(
                out,
                f"error against the truth {error.rmse:.2f} m (RMSE of {error.places} places, rigidly aligned), "
                f"worst {error.worst:.2f} m, {100 * error.share:.2f} % of the way",
            )
        if laid_on is not None:
            say(out, laid_on.told)
    if output is not None:
        from refseq_bench.scenarios.maps.drawings.plan import draw_plan

        with wrote(output, quiet=as_json):
            draw_plan(output, map_, laid_on)


@app.command(
    cls=BenchCommand,
    epilog="""Example: `refseq map route whole.refseq east:3 west:end`

Exit codes: 0 a route leads there; 1 none does; 2 bad input.""",
)
def route(
    map_file: MapFile,
    start: Annotated[
        str, typer.Argument(metavar="FROM", help="Place PATH:VIEW: a path and a view of it, from 0, or start or end.")
    ],
    goal: Annotated[str, typer.Argument(metavar="TO", help="Place to go to, likewise.")],
    as_json: Json = False,
) -> None:
    """Find the shortest route between two places of a map; paths are driven one way only."""
    map_ = read_map(map_file)

    from refseq.atlas.routes import NoRouteError, place_of, shortest_route, why_none
    from refseq_bench.scenarios.maps.routes import leg_table, route_in_words

    ends = place_of(map_, start), place_of(map_, goal)
    try:
        found = shortest_route(map_, *ends)
    except NoRouteError:
        # A place has as many names as paths run through it: say those that were asked for.
        say(err, f"no path leads from {start} to {goal}: {why_none(map_, *ends)}")
        raise typer.Exit(BELOW) from None
    if as_json:
        print_json({"length_m": found.length, "places": found.places.tolist(), "legs": found.legs})
        return
    if found.legs:
        out.print(leg_table(found))
    say(out, f"{found.length:.1f} m from {start} to {goal}, {route_in_words(found)}")


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq map matrix map.refseq`
* `refseq map matrix map.refseq -o matrix.png --top 20`""",
)
def matrix(
    map_file: MapFile,
    output: Annotated[Path | None, CHART] = None,
    top: Annotated[int, option("N", "Number of the most informative features to list.", min=0)] = 10,
    seed: Seed = 1,
    as_json: Json = False,
) -> None:
    """Describe a map's incidence matrix and what it tells about the place, and draw it."""
    import numpy as np

    from refseq.inference.matching.neighbours import Neighbours
    from refseq_bench.scenarios.maps.matrix import (
        features_table,
        information_table,
        statistics_table,
        summaries,
        top_features,
    )

    check_output(output, of=[map_file])
    with about(map_file):
        sequence = read_map(map_file).sequence
    found, neighbours = sequence.matrix, Neighbours.of(sequence.along)
    title = f"{map_file.name}: {found.N} features at {found.K} places"
    rows = summaries(found, np.random.default_rng(seed), neighbours)
    best = top_features(found, top, neighbours) if top else []
    if as_json:
        print_json({"features": found.N, "places": found.K, "kinds": rows, "top": best})
    else:
        out.print(statistics_table(title, rows))
        out.print(information_table(rows))
        if top:
            out.print(features_table(best))
    if output is not None:
        from refseq_bench.scenarios.maps.drawings.matrix import draw

        with wrote(output, quiet=as_json):
            draw(output, found, title)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq map channel map.refseq query.mcap`
* `refseq map channel map.refseq query.mcap --json`""",
)
@grouped
def channel(
    map_file: MapFile,
    query: QueryFile,
    seed: Seed = 1,
    as_json: Json = False,
    selection: NoisySelection = NoisySelection(),
) -> None:
    """Tell how a later drive sees a map's features again, and what they tell about the place at most."""
    import numpy as np

    from refseq_bench.scenarios.maps.channel import channel_summaries, channel_table, learnt_channels

    map_ = read_map(map_file)
    views = read_drive(query, selection.with_noise(seed + 1)).views
    with about(query):
        found = channel_summaries(map_, learnt_channels(map_, views), np.random.default_rng(seed))
    if as_json:
        print_json({"places": len(map_), "kinds": found})
    else:
        out.print(channel_table(f"{map_file.name} ← {query.name}: features as channels", found))


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq map paths map.refseq query.mcap`
* `refseq map paths map.refseq query.mcap --count 20 --durations 1 --second-order 1`""",
)
@grouped
def paths(
    map_file: MapFile,
    query: QueryFile,
    count: Annotated[int, option("N", "Number of paths.", min=1, max=1000)] = 5,
    durations: Annotated[
        float, option("WEIGHT", "Sort them anew by how long they stay at places.", min=0, max=100)
    ] = 0.0,
    second_order: Annotated[float, option("WEIGHT", "Sort anew by moves over two steps.", min=0, max=100)] = 0.0,
    seed: Seed = 1,
    as_json: Json = False,
    selection: NoisySelection = NoisySelection(),
) -> None:
    """List the best paths of a whole drive through a map, and how many bits its views tell of the path."""
    from refseq_bench.scenarios.maps.paths import best_paths, paths_table

    map_ = read_map(map_file)
    views = read_drive(query, selection.with_noise(seed + 1)).views
    with about(query):
        found = best_paths(map_, views, count, durations=durations, second_order=second_order, seed=seed)
    if as_json:
        print_json(found)
        return
    out.print(paths_table(f"{map_file.name} ← {query.name}: the {len(found.paths)} best paths", found, len(map_)))
    told = f"{len(views)} views tell {found.told:.1f} of {found.unknown:.1f} bits of the path"
    shares = f"these paths are {100 * sum(found.shares):.3g} % of all"
    say(out, f"{told}, {found.told / len(views):.2f} a view; {shares}")
