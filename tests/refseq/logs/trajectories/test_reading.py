"""Files written by another project (evo), by hand, and broken."""

import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from evo.core.trajectory import PosePath3D, PoseTrajectory3D
from evo.tools import file_interface
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from refseq.errors import LogError
from refseq.logs.trajectories import TrajectoryFormat, read_trajectory, write_trajectory
from refseq.logs.trajectories.geodesy import utm, zone_of
from refseq.planar import Pose

WAY = np.array([[0.1 * k, math.sin(k / 9), math.remainder(k / 7, 2 * math.pi)] for k in range(60)])
TIMES = 1_700_000_000.25 + 0.1 * np.arange(60)


def in_space(way: np.ndarray) -> list[np.ndarray]:
    """Planar poses as 4×4 matrices, z up."""
    found = []
    for x, y, heading in way:
        matrix = np.eye(4)
        matrix[:2, :2] = [[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]]
        matrix[:3, 3] = x, y, 0.3
        found.append(matrix)
    return found


# x right, y down, z ahead, seen from a robot with x ahead, y left, z up
CAMERA = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])


def assert_same(poses: np.ndarray, way: np.ndarray, atol: float = 1e-6) -> None:
    assert_allclose(poses[:, :2], way[:, :2], atol=atol)
    assert_allclose(np.exp(1j * poses[:, 2]), np.exp(1j * way[:, 2]), atol=atol)


def test_tum_of_evo(tmp_path: Path) -> None:
    file_interface.write_tum_trajectory_file(
        tmp_path / "a.txt", PoseTrajectory3D(poses_se3=in_space(WAY), timestamps=TIMES)
    )
    found = read_trajectory(tmp_path / "a.txt")
    assert found.form is TrajectoryFormat.TUM
    assert_allclose(found.timed().times, TIMES, atol=1e-6)
    assert_same(found.poses, WAY)


def test_tum_of_a_camera_looks_along_its_z_axis(tmp_path: Path) -> None:
    seen = PoseTrajectory3D(poses_se3=[pose @ CAMERA for pose in in_space(WAY)], timestamps=TIMES)
    file_interface.write_tum_trajectory_file(tmp_path / "a.txt", seen)
    assert_same(read_trajectory(tmp_path / "a.txt").poses, WAY)


@pytest.mark.parametrize("way", [WAY, WAY * [1, 0, 0]], ids=["curve", "straight"])
def test_kitti_of_evo_in_a_robots_and_in_a_cameras_axes(tmp_path: Path, way: np.ndarray) -> None:
    robot = in_space(way)
    camera = [np.linalg.inv(CAMERA) @ pose @ CAMERA for pose in robot]
    for name, poses in (("robot.txt", robot), ("camera.txt", camera)):
        file_interface.write_kitti_poses_file(tmp_path / name, PosePath3D(poses_se3=poses))
        found = read_trajectory(tmp_path / name)
        assert found.form is TrajectoryFormat.KITTI
        assert found.numbered
        assert_same(found.poses, way)
    assert found.notes == ("axes are a camera's, y down",)


def test_kitti_takes_times_from_the_log_or_from_a_file(tmp_path: Path) -> None:
    file_interface.write_kitti_poses_file(tmp_path / "a.txt", PosePath3D(poses_se3=in_space(WAY)))
    found = read_trajectory(tmp_path / "a.txt")
    assert_allclose(found.timed(TIMES).times, TIMES)
    with pytest.raises(LogError, match="has 60 poses without times, the log 59 pictures or scans; valid is one for"):
        found.timed(TIMES[:-1])
    (tmp_path / "times.txt").write_text("\n".join(f"{time:.6e}" for time in TIMES - TIMES[0]))
    assert_allclose(read_trajectory(tmp_path / "a.txt", tmp_path / "times.txt").keys, TIMES - TIMES[0], atol=1e-6)
    (tmp_path / "times.txt").write_text("0\n0.1\n")
    with pytest.raises(LogError, match=r"times.txt: holds 2 times for 60 poses; valid is one for each"):
        read_trajectory(tmp_path / "a.txt", tmp_path / "times.txt")


EUROC_HEADER = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"


@pytest.mark.parametrize("header", [EUROC_HEADER + ", v_RS_R_x [m s^-1]\n", ""])
def test_euroc(tmp_path: Path, header: str) -> None:
    poses = PoseTrajectory3D(poses_se3=in_space(WAY), timestamps=TIMES)
    rows = [
        ",".join([f"{round(time * 1e9)}", *map(str, xyz), *map(str, wxyz), "0.5"])
        for time, xyz, wxyz in zip(TIMES, poses.positions_xyz, poses.orientations_quat_wxyz, strict=True)
    ]
    (tmp_path / "data.csv").write_text(header + "\n".join(rows))
    found = read_trajectory(tmp_path / "data.csv")
    assert found.form in (TrajectoryFormat.EUROC, TrajectoryFormat.TABLE)
    assert_allclose(found.timed().times, TIMES, atol=1e-6)
    assert_same(found.poses, WAY)
    # what evo takes from the same file
    theirs = file_interface.read_euroc_csv_trajectory(tmp_path / "data.csv")
    assert_allclose(found.poses[:, :2], theirs.positions_xyz[:, :2])


@pytest.mark.parametrize(
    ("header", "row", "key", "heading"),
    [
        ("time,x,y,theta", "12.5,1,2,0.5", 12.5, 0.5),
        ("t_ns,x_m,y_m,yaw_deg", "12500000000,1,2,90", 12.5, math.pi / 2),
        ("scan_index_in_clf,x,y,theta", "7,1,2,0.5", 7, 0.5),
        (
            "%time,field.pose.position.x,field.pose.position.y,field.pose.position.z,field.pose.orientation.x,"
            "field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w",
            "1700000000250000000,1,2,0,0,0,0.7071068,0.7071068",
            1_700_000_000.25,
            math.pi / 2,
        ),
        ("x,y,heading,frame", "1,2,0.5,3", 3, 0.5),
    ],
)
def test_tables_by_their_header(tmp_path: Path, header: str, row: str, key: float, heading: float) -> None:
    (tmp_path / "a.csv").write_text(f"{header}\n{row}\n")
    ((found_key, pose),) = read_trajectory(tmp_path / "a.csv")
    assert found_key == pytest.approx(key, abs=1e-6)
    assert (pose.x, pose.y) == (1, 2)
    assert pose.heading == pytest.approx(heading, abs=1e-6)


@pytest.mark.parametrize(
    "content",
    [
        "time,x,y,yaw [deg]\n0.5,1.5,-2,90\n1.5,2.5,-2,180\n",
        "time;x;y;yaw [deg]\r\n0.5;1.5;-2;90\r\n1.5;2.5;-2;180\r\n",
        "# made elsewhere; by hand\n# time; x [m, world]; y; yaw [deg]\n0.5; 1.5; -2; 90\n1.5; 2.5; -2; 180\n",
        "time [s]\tx [m]\ty [m]\tyaw [deg]\n0.5\t1.5\t-2\t90\n1.5\t2.5\t-2\t180\n",
        "time x\ty yaw_deg\n0.5 1.5\t-2 90\n1.5 2.5\t-2 180\n",
        "time,x,y,yaw [deg]\n0.5;1.5;-2;90\n1.5;2.5;-2;180\n",
    ],
)
def test_commas_semicolons_tabs_and_spaces_separate_the_same_table(tmp_path: Path, content: str) -> None:
    (tmp_path / "a.csv").write_bytes(content.encode())
    found = read_trajectory(tmp_path / "a.csv")
    assert_allclose(found.keys, [0.5, 1.5])
    assert_allclose(found.poses, [[1.5, -2, math.pi / 2], [2.5, -2, math.pi]])


def test_positions_by_satellite(tmp_path: Path) -> None:
    # The CN tower in Toronto, as the usual worked example of the projection has it: 630 084 m east, 4 833 438 m north.
    (tower,) = utm(np.array([43.642567]), np.array([-79.387139]), zone_of(-79.387139))
    assert zone_of(-79.387139) == 17
    assert_allclose(tower, [630084, 4833438], atol=1)
    (tmp_path / "gps.csv").write_text("index,lat,lon\n0,40.6,-8.65\n1,40.6001,-8.65\n2,40.6001,-8.649\n")
    found = read_trajectory(tmp_path / "gps.csv")
    steps = np.diff(found.poses[:, :2], axis=0)
    # a ten-thousandth of a degree north is 11.1 m, a thousandth east 111.3 m times the cosine of the latitude
    assert_allclose(np.hypot(*steps.T), [11.1, 84.6], atol=0.1)
    assert_allclose(found.poses[:, 2], [math.pi / 2, 0, 0], atol=0.02)


@given(
    st.lists(
        st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(-math.pi, math.pi)), min_size=2, max_size=20
    ),
    st.sampled_from(["tum", "csv"]),
)
@settings(max_examples=25, deadline=None)
def test_what_is_written_is_read_again(way: list[tuple[float, float, float]], form: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a"
        write_trajectory(path, [(float(k), Pose(*pose)) for k, pose in enumerate(way)], form)
        found = read_trajectory(path)
    assert found.keys.tolist() == list(range(len(way)))
    assert_same(found.poses, np.array(way), 1e-8)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "holds no pose; valid is a trajectory"),
        ("# nothing but a comment\n", "holds no pose"),
        ("1,2,3\n", "rows of 3 numbers are no trajectory without a header .*: the first may be a time or x"),
        ("0,1,2,3\n1,1,2,3\n", "rows of 4 numbers .*: the first may be a time or a number of a picture or scan"),
        ("0.5,1,2,3,0,0,0,1\n", "rows of 8 numbers .*: the quaternion may begin with w or end with it"),
        ("1 2 3 4 5\n", "rows of 5 numbers .*: no format has so many"),
        ("1.5 0 0 0 0 0 0 1\n2.5 0 0 0 0 0 0\n", "line 2: has 7 fields; valid are 8, as in the first row"),
        ("1.5 0 0 0 0 0 0 1\n2.5 0 nan 0 0 0 0 1\n", "line 2: 'nan' is no finite number; valid is one in field 3"),
        ("1.5 0 0 0 0 0 0 1\n2.5 0 0 0 3 0 0 1\n", "line 2: its quaternion is 3.16 long; valid are rotations"),
        ("1.5 0 0 0 0 0 0 1\n1.0 0 0 0 0 0 0 1\n", "line 2: time 1 is before that of the row above, 1.5; valid"),
        ("2 0 0 0 0 2 0 0 0 0 2 0\n", "line 1: its first three columns of three are no rotation"),
        ("index,x,y,theta\n1.5,0,0,0\n", "line 2: number 1.5 is not valid; it should be a whole number of 0 or more"),
        ("index,lat,lon\n0,95,0\n", "line 2: latitude 95°, longitude 0°; valid are -84 to 84 and -180 to 180"),
        ("index,x,y\n0,1,1\n1,1,1\n", "goes nowhere and names no heading; valid is one with a column of headings"),
        ('"time";"x";"y";"yaw"\n"0.5";"1,5";"2";"0"\n', "line 2: '1,5' has a decimal comma; valid are decimal points"),
        ('"time","x","y","yaw"\n"0.5","1,5","2","0"\n', "line 2: '1,5' has a decimal comma; valid are decimal points"),
        ('"time","x","y"\n"0.5","1.5 m","2"\n', "line 2: '1.5 m' is no finite number; valid is one in field 2"),
        ("time,x,y,yaw\n2023-11-14T22:13:20,0,0,0\n", "line 2: '2023-11-14T22:13:20' names no time zone; valid is one"),
        ("time,x,y\n14.11.2023 22:13:20,0,0\n", "line 2: '14.11.2023 22:13:20' is no number; valid is one, or 2023-11"),
        ("time;x;y;yaw\n0,0;1,5;2;0\n", "line 2: '0,0' has a decimal comma; valid are decimal points"),
        ("time;x;y;yaw\n0;1.5;2,5;0\n", "line 2: '2,5' has a decimal comma"),
        ("time\tx\ty\tyaw\n0,5\t1,5\t2,5\t0,1\n", "line 2: '0,5' has a decimal comma"),
        ("0,5 1,5 2,5 0,1\n", "line 1: '0,5' has a decimal comma"),
        ("time|x|y\n0|1|2\n", r"holds no pose; valid .* with commas, semicolons, tabs or spaces between"),
        ("0.5;1;2;3;0;0;0;1\n", "rows of 8 numbers .*: the quaternion may begin with w or end with it"),
        ("time,x,y\n1760000000.25,0,0\n1760000000.2,1,0\n", "line 3: time 1760000000.2 is .*, 1760000000.25; valid"),
        (
            "Zeitstempel_ms;Pos X [mm];Pos Y [mm];Kurs\n1;0;0;0\n",
            r"its header names no time or index; not known are 'Zeitstempel_ms', 'Kurs'; valid are TUM",
        ),
        ("time;Ost;Nord\n1;0;0\n", r"its header names no x and y; not known are 'Ost', 'Nord'; valid are TUM"),
        ("x;y;z\n1;0;0\n", r"its header names no time or index; valid are TUM"),
        ("1.5 \0", "line 1: is no text of a trajectory; valid are lines of numbers"),
    ],
)  # fmt: skip
def test_broken_files(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "poses.txt"
    path.write_text(content)
    with pytest.raises(LogError, match=message) as told:
        read_trajectory(path)
    assert str(told.value).startswith(str(path))
    assert "\n" not in str(told.value)


def test_no_overlap_names_both_spans(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("1.5 0 0 0 0 0 0 1\n2.5 0 0 0 0 0 0 1\n")
    with pytest.raises(LogError, match=r"runs from 1.500 to 2.500 s, run.bag from 100.000 to 200.000 s; valid is a"):
        read_trajectory(tmp_path / "a.txt").within(100, 200, Path("run.bag"))


def test_rows_of_one_time_count_once(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("1.5 0 0 0 0 0 0 1\n" * 2 + "2.5 1 0 0 0 0 0 1\n")
    found = read_trajectory(tmp_path / "a.txt")
    assert found.keys.tolist() == [1.5, 2.5]
    assert found.notes == ("1 rows of the same time as the one above are left out",)


def test_lengths_and_angles_are_in_the_units_of_the_header(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time [min],x [cm],y [mm],heading [mrad]\n0,0,0,0\n0.5,85,100,100\n")
    found = read_trajectory(tmp_path / "a.csv")
    assert (found.keys.tolist(), found.notes) == ([0.0, 30.0], ())
    np.testing.assert_allclose(found.poses[1], [0.85, 0.1, 0.1])


def test_a_unit_that_nobody_knows_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time [utc],x [furlong],y,heading\n0,0,0,0\n1,2,0,0\n")
    assert set(read_trajectory(tmp_path / "a.csv").notes) == {
        "the unit 'furlong' of x is not known: it is taken for m",
        "the unit 'utc' of time is not known: it is taken for s",
    }


def about(unit: float, noise: float, header: str) -> str:
    """A table of a drive around a square of 12 m, whose headings count ``unit`` [rad]."""
    rng = np.random.default_rng(1)
    headings = np.repeat([0.0, math.pi / 2, math.pi, -math.pi / 2], 12)
    points = np.cumsum(np.column_stack([np.cos(headings), np.sin(headings)]), axis=0)
    told = (headings + rng.normal(0, noise, len(headings))) / unit
    rows = [f"{k},{x:.3f},{y:.3f},{heading:.5f}" for k, ((x, y), heading) in enumerate(zip(points, told, strict=True))]
    return "\n".join([header, *rows])


@pytest.mark.parametrize("metre", [1, 1000], ids=["metres", "millimetres"])
@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("header", ["time,x,y,yaw", "time,x,y,yaw [Grad]"])
def test_degrees_without_a_unit_are_refused(tmp_path: Path, metre: float, noise: float, header: str) -> None:
    """A robot that drives back, or a sensor that looks aside, changes nothing."""
    path = tmp_path / "odometry.csv"
    table = np.loadtxt(about(math.radians(1), noise, header).splitlines(), delimiter=",", skiprows=1)
    for aside in (0.0, 180.0, 90.0):
        rows = "\n".join(f"{time},{metre * x},{metre * y},{yaw + aside}" for time, x, y, yaw in table)
        path.write_text(f"{header}\n{rows}\n")
        with pytest.raises(LogError, match=r"go along its way as degrees and not as radians; valid .*heading \[deg\]"):
            read_trajectory(path)


@pytest.mark.parametrize(
    ("unit", "header"),
    [(1.0, "time,x,y,yaw"), (1.0, "time,x,y,yaw [rad]"), (math.radians(1), "time,x,y,yaw [deg]")],
)
def test_headings_in_the_unit_that_is_taken_are_read(tmp_path: Path, unit: float, header: str) -> None:
    path = tmp_path / "odometry.csv"
    path.write_text(about(unit, 0.3, header))
    assert np.abs(read_trajectory(path).poses[:, 2]).max() < 5


def test_a_way_that_tells_no_unit_is_read(tmp_path: Path) -> None:
    """Straight ahead both units say the same, and a robot that stands, or looks from side to side, along nothing."""
    path = tmp_path / "odometry.csv"
    path.write_text("\n".join(["time,x,y,yaw", *(f"{k},{k},0,{3 * (-1) ** k}" for k in range(20))]))
    assert len(read_trajectory(path)) == 20
    for rows in (["0,0,0,90", "1,0,9,90", "2,0,30,90"], ["0,0,0,90", "1,0,0,80"]):
        path.write_text("\n".join(["time,x,y,yaw", *rows]))
        assert read_trajectory(path).poses[0, 2] == 90


@pytest.mark.parametrize(
    "rows",
    [
        '"time","x","y","yaw"\n"1700000000.5","1","2","0.5"\n"1700000001.5","2","2","0.5"\n',
        '"time"; "x"; "y"; "yaw"\n"1700000000.5"; "1"; "2"; "0.5"\n"1700000001.5"; "2"; "2"; "0.5"\n',
        "time,x,y,yaw\n2023-11-14T22:13:20.5Z,1,2,0.5\n2023-11-14 23:13:21.500+01:00,2,2,0.5\n",
        '"time","x","y","yaw"\n"2023-11-14T22:13:20.500Z",1,2,0.5\n"2023-11-14T22:13:21.500Z",2,2,0.5\n',
    ],
)
def test_quotation_marks_and_dates_are_read(tmp_path: Path, rows: str) -> None:
    (tmp_path / "t.csv").write_text(rows)
    found = read_trajectory(tmp_path / "t.csv")
    assert found.keys.tolist() == [1_700_000_000.5, 1_700_000_001.5]
    assert found.poses.tolist() == [[1.0, 2.0, 0.5], [2.0, 2.0, 0.5]]
