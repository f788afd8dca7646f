"""The command ``refseq serve``: a robot's sensors in over a socket, beliefs out."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from refseq_bench.scenarios.cli.terminal.console import err, out
from refseq_bench.scenarios.cli.terminal.options import Access, MapFile, Seed, Sensors, grouped, option
from refseq_bench.scenarios.drives.inputs import assignments, load_map, stages, words
from refseq_bench.scenarios.tables import plural, say

if TYPE_CHECKING:
    from refseq.serve.session import ServeOptions

SERVE_HELP = """Examples:

* `refseq serve map.refseq`
* `refseq serve map.refseq --topics laser=/scan,camera-1=/front/image_raw --distance 0.5`
* `REFSEQ_TOKEN=3f9ab27c0d1e4856 refseq serve map.refseq --host 0.0.0.0`

Speaks the Foxglove WebSocket protocol: publish sensors as in a log, subscribe to `/belief`. One robot at a time. Ctrl-C
ends it."""


@dataclass(frozen=True)
class RobotTopics:
    """Topics, and how often a view is taken."""

    panel: ClassVar[str] = "Topics"
    distance: Annotated[
        float | None,
        option("METRES", "A view every so far by odometry; 0: each moment. [default: as the map's places]", min=0.0),
    ] = None
    topics: Annotated[
        str | None,
        option("NAME=TOPIC", "Name the topics of sensors, commas between: camera-1=/cam0/image_raw,laser=/scan."),
    ] = None
    odometry_topic: Annotated[str | None, option("TOPIC", "Topic of the odometry. [default: the first]")] = None
    leading: Annotated[
        str | None, option("SENSOR", "Sensor at whose times there are views. [default: the slowest]")
    ] = None
    tolerance: Annotated[
        float | None,
        option("SECONDS", "Sensors within so much make one view. [default: half a period, at most 0.25]", min=0.0),
    ] = None


@grouped
def serve(
    map_file: MapFile,
    stage: Annotated[str, option("STAGE", "uniform, prior or chain.")] = "chain",
    sensors: Sensors = None,
    seed: Seed = 1,
    robot: RobotTopics = RobotTopics(),
    access: Access = Access(),
) -> None:
    """Localise a robot while it drives: sensors in over a socket, beliefs out."""
    policy, options, map_ = access.policy, _options(stage, sensors, seed, robot), load_map(map_file)

    import asyncio

    from refseq.map.blocks.reckoned_once import reckon_once
    from refseq.serve.server import BeliefServer

    server = BeliefServer(map_, options, policy, lambda line: say(err, line))
    reckon_once(map_, stage=options.stage, sensors=options.sensors)
    asyncio.run(server.run(lambda address: say(out, f"{map_file}: serves at {address}; Ctrl-C ends it")))
    say(out, f"{map_file}: served {plural(server.views, 'view')} of {plural(server.drives, 'drive')}")


def _options(stage: str, sensors: str | None, seed: int, robot: RobotTopics) -> "ServeOptions":
    chosen, wanted = stages([stage])[0], words(sensors, "sensors")
    topics = assignments(words(robot.topics, "topics"), "topics")

    from refseq.serve.session import ServeOptions

    return ServeOptions(
        stage=chosen,
        sensors=wanted,
        seed=seed,
        distance=robot.distance,
        names={topic: name for name, topic in topics.items()},
        odometry=robot.odometry_topic,
        leading=robot.leading,
        tolerance=robot.tolerance,
    )
