"""What a log of a run says, read from logs that were written by hand."""
import pytest

from test_metrics import END, written
import run_log


def start(t_s, robot):
    return {"t": round(t_s * 1e6), "robot": robot, "event": "start"}


def end(t_s, robot):
    return {"t": round(t_s * 1e6), "robot": robot, "event": "end"}


def test_the_first_start_and_the_last_end_of_each_program_count(tmp_path):
    log = written(tmp_path, 2, [start(1, 0), start(2, 1), end(3, 0), start(4, 0), end(5, 1),
                                end(6, 0), END])
    assert log.times_of_programs() == ({0: 1_000_000, 1: 2_000_000}, {0: 6_000_000, 1: 5_000_000})
    assert log.starts() == {0: 4, 1: 2}
    assert log.start_s() == 4
    assert written(tmp_path, 2, []).start_s() == 0


def test_it_is_whole_when_it_went_to_the_scenarios_end(tmp_path):
    for seconds, is_whole in ((12, True), (11.9991, True), (11.99, False), (13, True)):
        log = written(tmp_path, 1, [start(0, 0), {"event": "air", "seconds": seconds}])
        assert (log.end_s(), log.is_whole()) == (seconds, is_whole)
    cut = written(tmp_path, 1, [start(1, 0), start(12, 0), start(3, 0)])
    assert (cut.end_s(), cut.is_whole()) == (12, False)
    assert written(tmp_path, 1, []).end_s() == 0


def test_what_was_being_written_when_it_was_cut_off_is_left_out(tmp_path):
    log = written(tmp_path, 1, [start(1, 0), start(2, 0)])
    text = log.path.read_text()
    for cut in (1, 2, 10):
        log.path.write_text(text[:-cut])
        assert len(run_log.Log(str(log.path)).events) == 1
    log.path.write_text(text[:text.index("\n") + 1])
    assert run_log.Log(str(log.path)).events == []
    for bad in ("", "{}\n", "[]\n", "nonsense\n", text + "nonsense}\n", text + '{"t": 1}\n'):
        log.path.write_text(bad)
        with pytest.raises(run_log.LogError, match="log.jsonl is not a log of a run"):
            run_log.Log(str(log.path))


def test_the_last_value_of_each_robot_until_a_time_counts(tmp_path):
    events = [{"t": t, "robot": robot, "event": "value", "name": name, "value": value}
              for t, robot, name, value in ((1, 0, "a", 5), (2, 0, "b", 6), (3, 1, "a", 7),
                                            (4, 0, "a", 8))]
    log = written(tmp_path, 2, events)
    assert log.values("a") == {0: 8, 1: 7}
    assert log.values("a", 3e-6) == {0: 5, 1: 7}
    assert log.values("a", 2.9e-6) == {0: 5}
    assert log.values("c") == {}


def test_faults_begin_and_end_at_their_times(tmp_path):
    late = {"kind": "jam", "at_s": 5, "end_s": 7, "x_mm": 0, "y_mm": 0, "radius_mm": 1}
    always = {"kind": "partition", "x_mm": 75}
    log = written(tmp_path, 1, [], faults=[late, always])
    for at_s, found in ((0, [always]), (4.9, [always]), (5, [always, late]),
                        (6.9, [always, late]), (7, [always])):
        assert log.faults(at_s) == found, at_s


def test_the_dead_are_those_that_were_not_started_again(tmp_path):
    faults = [{"kind": "restart", "robot": 0, "at_s": 6}, {"kind": "death", "robot": 0, "at_s": 3},
              {"kind": "death", "robot": 2, "at_s": 4}, {"kind": "death", "robot": 0, "at_s": 9}]
    log = written(tmp_path, 3, [], faults=faults)
    assert [log.dead(at_s) for at_s in (2, 3, 4, 6, 9)] == [set(), {0}, {0, 2}, {2}, {0, 2}]


def test_links_are_those_that_the_run_tells_or_all_within_range(tmp_path):
    assert written(tmp_path, 3, []).links() == {0: [1], 1: [0, 2], 2: [1]}
    assert written(tmp_path, 3, [], radio={"range_mm": 50}).links() == {0: [1], 1: [0, 2], 2: [1]}
    assert written(tmp_path, 3, [], radio={"range_mm": 49}).links() == {0: [], 1: [], 2: []}
    told = [{"t": 0, "robot": i, "event": "links", "to": to} for i, to in enumerate(([2], [], [0]))]
    assert written(tmp_path, 3, told).links() == {0: [2], 1: [], 2: [0]}
    with pytest.raises(run_log.LogError, match="cut off while it began"):
        written(tmp_path, 3, told[:2]).links()


def test_faults_and_deaths_take_links(tmp_path):
    """Four robots in a row, 50 mm apart, each heard by the next."""
    jam = {"kind": "jam", "at_s": 1, "end_s": 2, "x_mm": 100, "y_mm": 30, "radius_mm": 30}
    partition = {"kind": "partition", "at_s": 2, "end_s": 3, "x_mm": 50}
    death = {"kind": "death", "robot": 1, "at_s": 3}
    log = written(tmp_path, 4, [], faults=[jam, partition, death])
    assert log.links_at(0) == {0: [1], 1: [0, 2], 2: [1, 3], 3: [2]}
    assert log.links_at(1) == {0: [1], 1: [0], 2: [1, 3], 3: []}, "it is deaf, and heard"
    assert log.links_at(2) == {0: [], 1: [2], 2: [1, 3], 3: [2]}, "on the line is on its right"
    assert log.links_at(3) == {0: [], 1: [], 2: [3], 3: [2]}


def test_hops_are_the_fewest_over_links_of_one_direction(tmp_path):
    links = {0: [1, 2], 1: [3], 2: [1], 3: [4, 0], 4: [], 5: [0]}
    assert run_log.breadth_first(links, 0) == {0: 0, 1: 1, 2: 1, 3: 2, 4: 3}
    assert run_log.breadth_first(links, 4) == {4: 0}
    assert run_log.breadth_first(links, 5) == {5: 0, 0: 1, 1: 2, 2: 2, 3: 3, 4: 4}
