"""Tables for pandas: one for each topic, and every figure of every message in them."""

import csv
from itertools import chain

import numpy as np
import pandas as pd
import pytest

from mjnav.recording import open_log
from mjnav.recording.encode.particles import decode_particles
from mjnav.recording.encode.topics import topics
from mjnav.recording.export.csv_tables import TOPICS
from mjnav.recording.export.export import export


@pytest.fixture(scope="module")
def log(recorded):
    return open_log(recorded)


@pytest.fixture(scope="module")
def folder(log, tmp_path_factory):
    path = tmp_path_factory.mktemp("csv") / "out"
    counts = export(log, "csv", path)
    assert {name: len(rows(path, name)) for name in counts} == counts
    return path


def rows(folder, name: str) -> list[list[str]]:
    with open(folder / name, newline="") as file:
        return list(csv.reader(file))[1:]


def read(folder, name: str) -> pd.DataFrame:
    return pd.read_csv(folder / f"{name}.csv")


def stamped(log, topic):
    """Tick, time and value of each message."""
    return [(message.sequence, message.time_ns / 1e9, message.value) for message in log.messages(topic)]


def assert_table(table: pd.DataFrame, columns: str, expected: list) -> None:
    """The table's first columns after tick and time have these names, and its rows these values, bit for bit."""
    names = ["tick", "time", *columns.split()]
    assert list(table.columns[: len(names)]) == names
    assert len(table) == len(expected) > 0
    for name, values in zip(names, zip(*expected, strict=True), strict=True):
        found = table[name].tolist()
        assert [None if value != value else value for value in found] == list(values), name


def test_every_topic_of_a_log_has_its_tables(scenario):
    assert set(TOPICS) == {topic.name for topic in topics(scenario)}
    names = [table.name for tables in TOPICS.values() for table in tables]
    assert len(names) == len(set(names))


def test_the_robots_state_is_flat(log, folder):
    expected = []
    for tick, time, value in stamped(log, "/robot/state"):
        believed = value["estimate"]
        estimate = [None] * 14
        if believed is not None:
            estimate = [*believed["mean"], *chain(*believed["covariance"]), believed["ess"], believed["recovered"]]
        expected.append([tick, time, *value["pose"], *value["twist"], *estimate])
    covariance = " ".join(f"estimate_covariance_{a}_{b}" for a in ("x", "y", "theta") for b in ("x", "y", "theta"))
    columns = f"x y theta v omega estimate_x estimate_y estimate_theta {covariance} estimate_ess estimate_recovered"
    table = read(folder, "robot_state")
    assert_table(table, columns, expected)
    assert table["estimate_x"].isna().tolist() == [False] * 6 + [True]


def test_people_have_a_row_each_a_tick(log, folder):
    truth = [
        [tick, time, person["name"], *person["position"], *person["velocity"]]
        for tick, time, value in stamped(log, "/people/truth")
        for person in value["people"]
    ]
    assert_table(read(folder, "people_truth"), "name x y vx vy", truth)
    tracks = [
        [
            *(tick, time, person["name"], *person["position"], *person["velocity"]),
            *(*chain(*person["covariance"]), person["radius"], person["ess"], person["recovered"]),
        ]
        for tick, time, value in stamped(log, "/people/estimate")
        for person in value["people"]
    ]
    covariance = " ".join(f"covariance_{a}_{b}" for a in ("x", "y", "vx", "vy") for b in ("x", "y", "vx", "vy"))
    table = read(folder, "people_estimate")
    assert_table(table, f"name x y vx vy {covariance} radius ess recovered", tracks)
    assert len(table) == 3 * 5 + 2
    detections = [
        [tick, time, number, *position]
        for tick, time, value in stamped(log, "/people/estimate")
        for number, position in enumerate(value.get("detections", ()))
    ]
    assert_table(read(folder, "people_detections"), "detection x y", detections)


def test_odometry_commands_contacts_and_timing_are_as_logged(log, folder):
    odometry = [
        [tick, time, value["time"], value["interval"], value["v"], value["omega"], value["gyro"], *value["pose"]]
        for tick, time, value in stamped(log, "/odometry")
    ]
    assert_table(read(folder, "odometry"), "measured interval v omega gyro x y theta", odometry)
    command = [[tick, time, value["v"], value["omega"]] for tick, time, value in stamped(log, "/command")]
    assert_table(read(folder, "command"), "v omega", command)
    contacts = read(folder, "contacts")
    assert_table(
        contacts,
        "kind name force seen",
        [[3, 0.3, "person", "person2", 12.5, 0.43]] + [[6, 0.6, "person", "person2", 12.5, 0.43]] * 2,
    )
    timing = [[tick, time, *list(value.values())[1:]] for tick, time, value in stamped(log, "/tick")]
    phases = "sense_ns estimate_ns control_ns record_ns advance_ns"
    assert_table(read(folder, "tick"), f"{phases} lateness_ns deadline_missed", timing)


def test_a_decision_without_candidates_leaves_its_costs_empty(log, folder):
    expected, cone = [], []
    for tick, time, value in stamped(log, "/decision"):
        nominal, cost = value["nominal"] or {}, value["cost"] or {"lane": [None, None], "cone": []}
        costs = [cost.get("goal"), *cost["lane"], cost.get("total")]
        advice = value["advice"] or None
        chosen = [value["v"], value["omega"], value["status"], advice]
        expected.append([tick, time, *chosen, nominal.get("v"), nominal.get("omega"), *costs])
        cone += [[tick, time, number, figure] for number, figure in enumerate(cost["cone"])]
    table = read(folder, "decision")
    costs = "nominal_v nominal_omega cost_goal cost_lane_left cost_lane_right cost_total"
    assert_table(table, f"v omega status advice {costs}", expected)
    assert table["cost_total"].isna().tolist() == [False, False, True, False, False, False]
    assert_table(read(folder, "decision_cone"), "constraint cost", cone)


def test_a_scan_has_a_row_a_beam(log, folder):
    table = read(folder, "scan")
    ranges = np.array([value.ranges for _, _, value in stamped(log, "/scan")])
    np.testing.assert_array_equal(table["range"].to_numpy().reshape(-1, 360), ranges)
    assert np.isinf(table["range"]).any()
    np.testing.assert_allclose(table["angle"], 2 * np.pi * table["beam"] / 360 - np.pi, atol=1e-12)
    assert sorted(set(table["tick"])) == [0, 1, 3, 4, 5]


def test_particles_are_as_logged(log, folder):
    for topic, columns in [("/belief/robot", "x y theta weight"), ("/belief/obstacles", "x y vx vy weight track")]:
        table = read(folder, topic[1:].replace("/", "_"))
        assert list(table.columns) == ["tick", "time", *columns.split()]
        clouds = [np.stack([*decode_particles(cloud).values()], -1) for _, _, cloud in stamped(log, topic)]
        found = table.iloc[:, 2:].to_numpy(np.float32)
        np.testing.assert_array_equal(found, np.concatenate(clouds).astype(np.float32))
    assert set(table["track"]) == {0, 1, 2}


def test_samples_and_desired_samples_of_the_cone_are_labelled(log, folder):
    table = read(folder, "cone")
    for tick, _, value in stamped(log, "/cone"):
        of_tick = table[table["tick"] == tick]
        assert set(of_tick["obstacle"]) == {"person1"}
        assert set(of_tick["safe_share"]) == {value.safe_share}
        for kind in ("samples", "desired"):
            found = of_tick.loc[of_tick["kind"] == kind, "f"].to_numpy(np.float32)
            np.testing.assert_array_equal(found, np.array(getattr(value, kind), np.float32))


def test_poses_and_transforms_are_as_logged(log, folder):
    for topic in ("/robot/truth", "/robot/estimate"):
        expected = []
        for tick, time, value in stamped(log, topic):
            p, q = value.pose.position, value.pose.orientation
            expected.append([tick, time, "map", p.x, p.y, p.z, q.x, q.y, q.z, q.w])
        assert_table(read(folder, topic[1:].replace("/", "_")), "frame x y z qx qy qz qw", expected)
    table = read(folder, "tf")
    assert table["child"].tolist() == ["base_link", "base_link_estimated"] * 6 + ["base_link"]
    of_truth = table[table["child"] == "base_link"].drop(columns=["parent", "child"]).to_numpy()
    np.testing.assert_array_equal(of_truth, read(folder, "robot_truth").drop(columns="frame").to_numpy())


def test_the_scene_has_a_row_a_solid_and_a_segment(log, folder):
    scenario, solids = log.scenario(), read(folder, "scene")
    assert sorted(set(solids["tick"])) == list(range(7))
    first = solids[solids["tick"] == 0].groupby(["entity", "shape"]).size().to_dict()
    assert first == {
        ("walls", "box"): 2,
        **{(f"table{i}", shape): n for i in (0, 1) for shape, n in (("box", 1), ("cylinder", 4))},
        ("pillars", "cylinder"): 2,
        ("goal", "cylinder"): 1,
        ("robot", "cylinder"): 1,
        ("robot", "arrow"): 1,
        ("people", "cylinder"): 3,
    }
    people = solids[solids["entity"] == "people"]
    truth = read(folder, "people_truth")
    assert people[["x", "y"]].to_numpy().tolist() == truth[["x", "y"]].to_numpy().tolist()
    assert set(people["size_x"]) == {2 * scenario.people[0].radius}
    arrow = solids[solids["shape"] == "arrow"].iloc[0]
    assert arrow["frame"] == "base_link"
    assert arrow["size_x"] == pytest.approx(scenario.robot.radius)
    lanes = read(folder, "scene_lines")
    one = lanes[lanes["tick"] == 3][["entity", "line", "from_x", "from_y", "to_x", "to_y"]].to_numpy().tolist()
    assert one == [["lanes", 0, 0.0, 2.5, 10.0, 2.5], ["lanes", 1, 0.0, -2.5, 10.0, -2.5]]


def test_every_candidate_has_a_row_with_its_costs_and_what_it_was(log, folder):
    table, cone = read(folder, "candidates"), read(folder, "candidates_cone")
    assert table["tick"].value_counts().to_dict() == dict.fromkeys((0, 1, 3, 4, 5), 21)  # tick 2 had none
    for tick, _, decision in stamped(log, "/decision"):
        if decision["cost"] is None:
            continue
        rows = (table["tick"] == tick) & table["role"].str.contains("chosen", na=False)
        ((_, chosen),) = table[rows].iterrows()
        assert (chosen["v"], chosen["omega"]) == (decision["v"], decision["omega"])
        assert np.float32(chosen["total"]) == np.float32(decision["cost"]["total"])
        terms = cone[(cone["tick"] == tick) & (cone["candidate"] == chosen["candidate"])]
        assert np.float32(terms["cost"]).tolist() == np.float32(decision["cost"]["cone"]).tolist()


def test_events_with_commas_are_quoted(folder):
    table = read(folder, "events")
    assert table["text"].tolist() == [f"the robot, again: {tick}" for tick in (0, 1, 3, 4, 5)]
    assert set(table["level"]) == {"WARNING"}


def test_columns_csv_names_every_column_of_every_table_in_order(folder):
    units = pd.read_csv(folder / "columns.csv", keep_default_na=False)
    tables = sorted(path.stem for path in folder.iterdir() if path.stem != "columns")
    assert sorted(set(units["table"])) == tables
    for name in tables:
        assert units.loc[units["table"] == name, "column"].tolist() == list(read(folder, name).columns)
    unit = units.set_index(["table", "column"])["unit"].to_dict()
    assert unit["command", "omega"] == "rad/s"
    assert unit["people_estimate", "covariance_x_vy"] == "m*m/s"
    assert unit["decision", "status"] == ""


def test_only_the_topics_asked_for_are_written(log, tmp_path):
    counts = export(log, "csv", tmp_path / "out", topics=["/command", "/people/estimate"])
    assert counts == {"command.csv": 6, "people_estimate.csv": 17, "people_detections.csv": 15}
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["columns.csv", "command.csv", "people_detections.csv", "people_estimate.csv"]


def test_a_topic_without_messages_has_an_empty_table(driven, tmp_path):
    assert driven.topics["/contacts"].messages > 0
    counts = export(driven, "csv", tmp_path / "out", topics=["/contacts"])
    assert counts == {"contacts.csv": 0}
    assert (tmp_path / "out" / "contacts.csv").read_text() == "tick,time,kind,name,force,seen\n"
