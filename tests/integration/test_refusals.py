"""What swarmtalkd refuses: a message for which a link has no room, a wrong command line."""
import pytest
from conftest import program, run, wait_for


def test_a_long_message_is_refused_when_the_mtu_is_small(bridge_lab):
    lab = bridge_lab(1)
    device = lab.status(1)["links"][0]["device"]
    done = run("ip", "netns", "exec", lab.namespace(1), "ip", "link", "set", device, "mtu", "1000")
    assert done.returncode == 0, done.stderr
    wait_for(lambda: "MTU 1000" in lab.status(1)["links"][0]["state"], what="new MTU")
    refused = lab.cli(1, "pub", "c", "x" * 1200)
    assert refused.returncode != 0
    assert "raise the MTU" in refused.stderr, refused.stderr
    assert lab.cli(1, "pub", "c", "x" * 500).returncode == 0
    assert lab.link_counter(1, "packets_over_mtu") == 0
    wait_for(lambda: "perhaps nobody gets this" in lab.cli(1, "pub", "c", "x").stderr,
             what="that no other robot is there")


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
