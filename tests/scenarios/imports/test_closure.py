from pathlib import Path

import pytest

from refseq_bench.scenarios.imports.closure import ROOT, closure_of


@pytest.fixture
def rooms(tmp_path: Path) -> Path:
    """A bench of a few modules."""
    files = {
        "refseq/__init__.py": """
            MODULES = {"Map": "refseq.map.map", "learn": "refseq.map.learn", "View": "refseq.view"}
            def __getattr__(name):
                return getattr(importlib.import_module(MODULES[name]), name)
        """,
        "refseq/map/__init__.py": "",
        "refseq/map/map.py": "class Map: pass",
        "refseq/map/learn.py": "def learn():\n    from refseq import view\n    import cv2.gapi",
        "refseq/view.py": "class View: pass",
        "refseq/typed.py": "if TYPE_CHECKING:\n    import refseq_bench.sim\nelse:\n    import refseq.view",
        "refseq/told.py": "import_module('refseq.view')",
        "refseq/untold.py": "import importlib\n\nimportlib.import_module(name)",
        "refseq_bench/__init__.py": "",
        "refseq_bench/worlds/__init__.py": """
            _LATE = {"refseq_bench.worlds.plans": ("load", "Plan"), "refseq_bench.worlds.light": ("Light",)}
            def __getattr__(name):
                ...
        """,
        "refseq_bench/worlds/light.py": "",
        "refseq_bench/worlds/plans/__init__.py": "from .files import load",
        "refseq_bench/worlds/plans/files.py": "from importlib.resources import files\nT = files('refseq_bench.worlds')",
        "refseq_bench/worlds/library/hall.toml": "name = 'hall'",
        "refseq_bench/worlds/library/README.md": "Worlds.",
        "refseq_bench/robots/__init__.py": """
            def __getattr__(name):
                if name == "Robot":
                    from refseq_bench.robots.robot import Robot
                    return Robot
                from refseq_bench.robots.load import load
                return load
        """,
        "refseq_bench/robots/robot.py": "",
        "refseq_bench/robots/load.py": "from refseq_bench.robots import wheels",
        "refseq_bench/robots/wheels/__init__.py": "MODEL = Path(__file__).with_name('wheels.xml')",
        "refseq_bench/robots/wheels/wheels.xml": "<mujoco/>",
        "refseq_bench/robots/wheels/deep/part.stl": "solid",
    }  # fmt: skip
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        lines = text.splitlines()
        indent = min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=0)
        (tmp_path / name).write_text("\n".join(line[indent:] for line in lines))
    return tmp_path


def reached(rooms: Path, text: str) -> set[str]:
    """Files of the rooms that a module reaches, but for itself and packages' own."""
    (rooms / "refseq_bench" / "sim").mkdir(exist_ok=True)
    (rooms / "refseq_bench" / "sim" / "it.py").write_text(text)
    (rooms / "refseq_bench" / "sim" / "__init__.py").touch()
    found = set(closure_of("refseq_bench.sim.it", root=rooms).files)
    assert {"refseq_bench/sim/__init__.py", "refseq_bench/sim/it.py"} <= found
    return {name for name in found if not name.endswith("__init__.py")} - {"refseq_bench/sim/it.py"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("import refseq", set()),
        ("import refseq.view", {"refseq/view.py"}),
        ("from refseq import view", {"refseq/view.py"}),
        ("from refseq import MODULES", set()),
        ("from refseq import Map", {"refseq/map/map.py"}),
        ("from refseq import learn as l", {"refseq/map/learn.py", "refseq/view.py"}),
        ("def f():\n    from refseq import Map", {"refseq/map/map.py"}),
        ("import refseq\nrefseq.Map.load()", {"refseq/map/map.py"}),
        ("import refseq as r\ndef f():\n    return r.View", {"refseq/view.py"}),
        ("import refseq\ngetattr(refseq, name)", {"refseq/map/map.py", "refseq/map/learn.py", "refseq/view.py"}),
        ("from refseq import *", {"refseq/map/map.py", "refseq/map/learn.py", "refseq/view.py"}),
        ("import refseq.typed", {"refseq/typed.py", "refseq/view.py"}),
        ("from refseq import told", {"refseq/told.py", "refseq/view.py"}),
        ("from refseq_bench.worlds import Light", {"refseq_bench/worlds/light.py"}),
        (
            "from refseq_bench.worlds import Plan",
            {"refseq_bench/worlds/plans/files.py", "refseq_bench/worlds/library/hall.toml"},
        ),
        ("from refseq_bench.robots import Robot", {"refseq_bench/robots/robot.py"}),
        (
            "from refseq_bench import robots\nrobots.load()",
            {
                "refseq_bench/robots/load.py",
                "refseq_bench/robots/wheels/wheels.xml",
                "refseq_bench/robots/wheels/deep/part.stl",
            },
        ),
    ],
)
def test_imports_are_followed_to_what_can_run(rooms: Path, text: str, expected: set[str]) -> None:
    assert reached(rooms, text) == expected


def test_installed_packages_count_by_their_version_and_missing_ones_as_absent(rooms: Path) -> None:
    (rooms / "refseq" / "view.py").write_text("import no_such_package, json\nfrom scipy.stats import norm")
    versions = closure_of("refseq.map.learn", root=rooms).versions
    assert set(versions) == {"python", "scipy", "opencv-python-headless", "no_such_package"}
    assert versions["no_such_package"] == "absent"


def test_a_module_alone_counts_without_its_imports(rooms: Path) -> None:
    closure = closure_of("refseq.view", alone=("refseq.map.learn",), root=rooms)
    assert set(closure.files) == {"refseq/__init__.py", "refseq/view.py", "refseq/map/learn.py"}


def test_an_import_by_a_name_that_is_made_up_is_told(rooms: Path) -> None:
    assert closure_of("refseq.untold", root=rooms).untold == ("refseq/untold.py:3",)


@pytest.mark.parametrize("given", [{"modules": ["refseq.gone"]}, {"modules": ["gone"]}, {"alone": ["refseq.gone"]}])
def test_a_module_that_is_not_there_is_an_error(rooms: Path, given: dict[str, list[str]]) -> None:
    with pytest.raises(ModuleNotFoundError, match=r"No module named '.*gone'"):
        closure_of(*given.get("modules", ()), alone=given.get("alone", ()), root=rooms)


def test_the_bench_imports_by_made_up_names_only_parts_of_mujoco_localisers_and_commands() -> None:
    modules = [
        path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".").removesuffix(".__init__")
        for room in (ROOT / "refseq", *sorted((ROOT / "refseq_bench").iterdir()))
        for path in sorted(room.rglob("*.py"))
    ]
    untold = closure_of(*modules).untold
    assert {place.partition(":")[0] for place in untold} == {
        "refseq_bench/scenarios/cli/app.py",  # by which nothing is kept: no task imports the command line
        "refseq_bench/scenarios/methods/baselines/__init__.py",  # keys name the modules of their methods
        "refseq_bench/scenarios/methods/guests/host.py",
        "refseq_bench/sim/rendering/drivers.py",
    }
