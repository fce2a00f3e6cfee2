"""A robot between two others passes on what they cannot hear of each other."""
import json
import subprocess

import pytest
from conftest import program, run, wait_for


def put_in_line(lab):
    """Robots 1 and 3 hear robot 2 only: isolated ports of a bridge reach no isolated port."""
    for robot in (1, 3):
        done = run("ip", "netns", "exec", f"swarmtalk-{lab.name}-air", "bridge", "link", "set",
                   "dev", f"robot{robot}", "isolated", "on")
        assert done.returncode == 0, done.stderr


def robot_that_runs_nothing_forwards(lab):
    subscriber = lab.start_sub(3, "--json", "--count", "1", "relay")
    done = lab.cli(1, "pub", "--ttl", "3", "relay", "over the hill")
    assert done.returncode == 0, done.stderr
    try:
        out, _ = subscriber.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        subscriber.kill()
        raise
    heard = json.loads(out)
    assert (heard["hops"], heard["sender"], heard["transmitter"]) == (1, 1, 2), out


def small_message_goes_and_long_one_is_refused_when_the_mtu_is_small(lab):
    device = lab.status(1)["links"][0]["device"]
    done = run("ip", "netns", "exec", lab.namespace(1), "ip", "link", "set", device, "mtu", "1000")
    assert done.returncode == 0, done.stderr
    wait_for(lambda: "MTU 1000" in lab.status(1)["links"][0]["state"], what="new MTU")
    refused = lab.cli(1, "pub", "c", "x" * 1200)
    assert refused.returncode != 0
    assert "raise the MTU" in refused.stderr, refused.stderr
    assert lab.cli(1, "pub", "c", "x" * 500).returncode == 0
    assert lab.link_counter(1, "packets_over_mtu") == 0


def test_a_row_of_robots_passes_on_what_fits(bridge_lab):
    lab = bridge_lab(3)
    put_in_line(lab)
    robot_that_runs_nothing_forwards(lab)
    small_message_goes_and_long_one_is_refused_when_the_mtu_is_small(lab)


@pytest.mark.logic
def test_wrong_command_lines_are_told_in_one_line(tmp_path):
    for words in (["--bogus"], ["extra"], ["--log-level", "loud"]):
        done = run(program("swarmtalkd"), *words)
        assert done.returncode == 2
        assert done.stderr.startswith("swarmtalkd: "), done.stderr
        assert done.stderr.endswith("; see swarmtalkd --help\n"), done.stderr
        assert done.stderr.count("\n") == 1, done.stderr
    done = run(program("swarmtalkd"), "--confg", "x")
    assert done.stderr == ("swarmtalkd: there is no option '--confg'; did you mean '--config'? "
                           "See swarmtalkd --help\n")
    config = tmp_path / "d.toml"
    config.write_text('[links.w]\ntype = "udp"\n')
    done = run(program("swarmtalkd"), "--config", config, "--check", "--socket", "")
    assert done.returncode == 1
    assert "--socket: is empty" in done.stderr, done.stderr
