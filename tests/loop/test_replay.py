"""A log can be run again: nothing differs, or what does is found where it begins."""

import json
import os
from dataclasses import replace as changed

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

import mjnav
from mjnav.errors import InputError
from mjnav.loop.episode import Episode
from mjnav.loop.replay import TickComparison, replay
from mjnav.loop.supervision import RunFault
from mjnav.study.avoidable import Source, judge

OWN = """
from mjnav.control.methods.mean import Mean

class Timid(Mean):
    slowness = 0.5

    def decide(self, observation):
        decision = super().decide(observation)
        return type(decision)(self.slowness * decision.v, decision.omega, decision.status, decision.costs)
"""


def rewrite(path, message=lambda topic, tick, document: document, attachment=lambda name, data: data, keep=None):
    """The same log with other JSON documents, other attachments, or without the ticks that are not kept."""
    out = path.with_name("rewritten.mcap")
    with open(path, "rb") as source, open(out, "wb") as target:
        reader, writer = make_reader(source), Writer(target, chunk_size=50_000)
        writer.start()
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        writer.add_metadata("mjnav/run", metadata["mjnav/run"])
        for found in reader.iter_attachments():
            writer.add_attachment(0, 0, found.name, found.media_type, attachment(found.name, found.data))
        schemas, channels = {}, {}
        for schema, channel, found in reader.iter_messages(log_time_order=False):
            if keep is not None and not keep(found.sequence):
                continue
            if channel.id not in channels:
                if schema.id not in schemas:
                    schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id]
                )
            data = found.data
            if channel.message_encoding == "json":
                data = json.dumps(message(channel.topic, found.sequence, json.loads(data))).encode()
            writer.add_message(channels[channel.id], found.log_time, data, found.publish_time, found.sequence)
        if "mjnav/result" in metadata:
            writer.add_metadata("mjnav/result", metadata["mjnav/result"])
        writer.finish()
    return out


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.mcap"


@pytest.fixture
def logged(room, path):
    """The log of a run of ten ticks."""
    Episode(room("control.method=mean"), log=path).run()
    return path


# ------------------------------------------------------------------------------------------- identical


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("hall", ()),
        ("lane", ("control.method=cvar",)),
        ("crossing3", ("physics.engine=kinematic", "control.method=orca")),
        ("crossing2", ("control.method=mppi", "control.rate=4", "sensors.rate=20", "estimation.robot.filter=ekf")),
        ("crossing1", ("noise.profile=none", "control.delay=0", "control.rate=50")),
    ],
)
def test_every_kind_of_run_is_the_same_again(path, name, overrides):
    result = Episode(mjnav.load_scenario(name, ("time_limit=1.5", *overrides)), log=path).run()
    found = replay(path)
    assert found.differences == ()
    assert (found.identical, found.complete, found.missing) == (True, True, 0)
    assert found.ticks == result.summary["ticks"] > 5
    assert (found.outcome, found.state_hash) == ("timeout", result.summary["state_hash"])


@pytest.mark.parametrize("share", [0.5, 0.8, 0.97])
def test_a_log_that_was_cut_off_is_compared_as_far_as_it_goes(room, path, share):
    Episode(room("time_limit=4"), log=path).run()
    os.truncate(path, int(path.stat().st_size * share))
    found = replay(path)
    assert (found.identical, found.complete, found.outcome, found.state_hash) == (True, False, None, None)
    assert share * 40 - 10 < found.ticks <= 40


def test_an_interrupted_run_is_repeated_up_to_there(room, path):
    left = iter([False] * 7)
    Episode(room(), log=path, stop=lambda: next(left, True)).run()
    found = replay(path)
    assert (found.identical, found.ticks, found.outcome) == (True, 7, "aborted")


def test_ticks_that_the_log_had_to_drop_are_passed_over(logged):
    holed = rewrite(logged, keep=lambda tick: tick not in (3, 4, 9))
    with pytest.raises(
        InputError, match=r"2 of 10 ticks are whole from its start on: how its run ended cannot be judged"
    ):
        judge(Source(holed))
    found = replay(holed)
    assert (found.identical, found.ticks, found.missing) == (True, 7, 3)


def test_a_class_of_mjnavs_own_is_no_foreign_code(room, path):
    Episode(room(controller="mjnav.control.methods.saa:Saa"), log=path).run()
    assert replay(path).identical


def test_defaults_are_those_that_the_run_had(room, path):
    place = "mjnav.control.methods.rkhs:Rkhs"  # which has other defaults than "rkhs"
    Episode(room(controller=place), log=path).run()

    def named(name, data):
        return data.replace(place.encode(), b"rkhs") if name == "scenario.toml" else data

    log = rewrite(path, attachment=named)
    assert [(one.field, one.again) for one in replay(log).differences] == [("controller", "rkhs")]
    assert replay(log, controller="rkhs").differences[0].part == "decision"


def test_a_controller_of_ones_own_from_the_working_folder(room, path, tmp_path, monkeypatch):
    (tmp_path / "own_for_replay.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    Episode(room(controller="own_for_replay:Timid"), log=path).run()
    with pytest.raises(InputError, match=r"a\.mcap: its controller is 'own_for_replay:Timid', code .*trust=True"):
        replay(path)
    assert replay(path, trust=True).identical
    (tmp_path / "moved_for_replay.py").write_text(OWN)
    moved = replay(path, controller="moved_for_replay:Timid")
    assert moved.identical
    assert moved.warnings == (
        "controller was own_for_replay:Timid, is moved_for_replay:Timid",
        "moved_for_replay.py was added",
        "own_for_replay.py is gone",
    )
    with pytest.raises(InputError, match="a module that can be imported"):
        replay(path, controller="nowhere_for_replay:Timid")
    other = replay(path, controller="mean")
    assert not other.identical
    assert other.warnings == ("controller was own_for_replay:Timid, is mean", "own_for_replay.py is gone")
    monkeypatch.setattr("own_for_replay.Timid.slowness", 0.6)
    found = replay(path, trust=True)
    assert found.tick == 0
    assert {difference.part for difference in found.differences} == {"decision"}


# --------------------------------------------------------------------------------------------- it differs


@pytest.mark.parametrize(
    ("topic", "way", "part", "field"),
    [
        ("/robot/state", ("pose", 1), "truth", "/robot/state pose.1"),
        ("/odometry", ("gyro",), "reading", "/odometry gyro"),
        ("/robot/state", ("estimate", "mean", 2), "estimate", "/robot/state estimate.mean.2"),
        ("/people/estimate", ("people", 0, "position", 0), "tracks", "/people/estimate people.person0.position.0"),
        ("/decision", ("omega",), "decision", "/decision omega"),
        ("/command", ("v",), "command", "/command v"),
    ],
)
def test_one_number_that_was_altered_is_found_at_its_tick_and_by_its_amount(logged, topic, way, part, field):
    def altered(found_topic, tick, document):
        if (found_topic, tick) == (topic, 6):
            *outer, last = way
            inner = document
            for key in outer:
                inner = inner[key]
            inner[last] += 2e-9
        return document

    found = replay(rewrite(logged, altered))
    (difference,) = found.differences
    assert (found.tick, found.time, found.ticks) == (6, pytest.approx(0.6), 7)
    assert (difference.part, difference.field) == (part, field)
    assert difference.amount == pytest.approx(2e-9, abs=1e-15)
    assert difference.logged - difference.again == pytest.approx(2e-9, abs=1e-15)


def test_a_plan_that_is_another_is_told_and_one_that_an_earlier_log_lacks_is_not(room, path):
    records = []
    Episode(room("control.method=mppi"), log=path, watch=records.append).run()
    log, record = mjnav.open_log(path), records[3]
    comparison = TickComparison(log.scenario())
    _, documents = [*comparison.logged(log)][3]
    assert comparison.tick(documents, record) == []
    plan = changed(record.decision.plan, fan_cost=record.decision.plan.fan_cost + 1.0)
    found = comparison.tick(documents, changed(record, decision=changed(record.decision, plan=plan)))
    assert [(one.part, one.field) for one in found] == [("decision", f"/plan fan_cost.{i}") for i in range(32)]
    assert comparison.tick({name: said for name, said in documents.items() if name != "/plan"}, record) == []


def test_the_state_in_which_the_run_ended_counts_and_so_does_the_result(logged):
    def altered(topic, tick, document):
        if (topic, tick) == ("/robot/state", 10):
            document["twist"][0] = 7.0
        return document

    found = replay(rewrite(logged, altered))
    assert (found.tick, found.differences[0].part, found.differences[0].logged) == (10, "truth", 7.0)


@pytest.mark.parametrize(("limit", "again"), [(0.5, "timeout after 5 ticks"), (2.0, "goes on")])
def test_a_run_that_ends_at_another_time_is_told(logged, limit, again):
    def longer(name, data):
        return data.replace(b"time_limit = 1.0", f"time_limit = {limit}".encode()) if name == "scenario.toml" else data

    (difference,) = replay(rewrite(logged, attachment=longer)).differences
    assert (difference.part, difference.logged, difference.again) == ("run", "timeout after 10 ticks", again)


# ------------------------------------------------------------------------------------- faults, other files


def test_a_run_that_its_controller_broke_is_repeated_up_to_there(room, path, tmp_path, monkeypatch):
    code = OWN.replace("decision = ", "decision = observation.time < 0.55 and ").replace("own", "breaking")
    (tmp_path / "breaking_for_replay.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(RunFault, match="AttributeError: 'bool' object has no attribute"):
        Episode(room(controller="breaking_for_replay:Timid"), log=path).run()
    found = replay(path, trust=True)
    assert (found.identical, found.complete, found.ticks, found.outcome) == (True, True, 5, "aborted")
