"""What hostile programs on the robot can do to the daemon, and what they cannot. Each attack is a
program in attacks/, run as a user without rights; benchmarks/hostile.py prints its figures."""
import fcntl
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import pytest

sys.path.append(str(pathlib.Path(__file__).resolve().parent / "attacks"))

from local_client import (ROOT, STRANGER, Client, Daemon, MemoryGroup, field, frame,  # noqa: E402
                          wait_for)

SEED = int(os.environ.get("SWARMTALK_SEED", "1"))

needs_other_user = pytest.mark.skipif(os.geteuid() != 0, reason="being another user needs root")


def close_connections_without_a_process():
    with Daemon("[limits]\nclients = 20\n") as daemon:
        daemon.attack("doomed_sessions", 15).wait(60)
        wait_for(lambda: daemon.status()["clients"] == 1, "all slots but our own")
        assert daemon.counter("clients_malformed") == 15


def shares_of(daemon, uid):
    users = [user for user in daemon.status()["users"] if user["uid"] == uid]
    return users[0]["shares"] if users else {}


def leave_places_channels_and_room_to_others():
    with Daemon("[limits]\nclients = 40\nclients_per_user = 20\nchannels_per_client = 10\n"
                "channels_per_user = 15\nwaiting_messages_per_client = 300\n"
                "waiting_messages_per_user = 500\n") as daemon:
        attack = daemon.attack("fill_shares", "waiting", "channels", "places",
                               stdin=subprocess.PIPE)
        taken = json.loads(attack.stdout.readline())
        assert taken["waiting"]["given"] == 500, taken
        assert "waiting_messages_per_user" in taken["waiting"]["refusal"], taken
        assert f"uid {STRANGER}" in taken["waiting"]["refusal"]
        assert max(taken["channels"]["given"]) <= 10
        assert "channels_per" in taken["channels"]["refusal"]
        assert taken["places"]["given"] == 20 - 6 - 4
        refusal = f"uid {STRANGER} has 20 clients already, clients_per_user"
        assert refusal in taken["places"]["refusal"]
        shares = shares_of(daemon, STRANGER)
        assert shares["clients"] == {"used": 20, "limit": 20}
        assert shares["waiting_messages"] == {"used": 500, "limit": 500}
        # Everybody else goes on as before.
        others = [Client(daemon.socket) for _ in range(10)]
        for number, other in enumerate(others):
            publisher = other.advertise(f"own {number}", queue=16)
            assert isinstance(publisher, int), publisher
            body = field(1, publisher) + field(2, 1) + field(3, b"x")
            other.socket.sendall(frame(field(11, body)))
            assert 12 in other.take()  # sent
        attack.communicate("")


def keep_places_for_operators():
    with Daemon("[limits]\nclients = 16\nclients_per_user = 16\n") as daemon:
        attack = daemon.attack("fill_shares", "places", stdin=subprocess.PIPE)
        taken = json.loads(attack.stdout.readline())["places"]
        assert taken["given"] == 12
        assert "4 of them are kept for root" in taken["refusal"]
        assert daemon.status()["clients"] == 13
        attack.communicate("")


def let_floods_of_changes_cost_their_sender_only():
    names = "".join(f"channel{number} = {number}\n" for number in range(1024))
    with Daemon("[channels]\n" + names) as daemon:
        other = Client(daemon.socket)
        other.take()
        attack = daemon.attack("flood_changes", 256, 20000)
        answers = 0
        while attack.poll() is None and answers < 40_000:
            assert 18 in other.ask(field(17, b""))  # get_pose
            answers += 1
        result = daemon.finish(attack)
        assert answers > 100
        assert result["reloads"] == 256  # answered all, done once or twice
        lines = daemon.log.read_text().splitlines()
        assert sum("configuration reloaded" in line for line in lines) <= 5
        assert result["node_ids"] < 2000 and "_hz under [limits]" in result["refusal"]
        assert daemon.log.stat().st_size < 100_000
        assert daemon.counter("requests_too_fast") > 10_000


@pytest.fixture
def group():
    """A control group with the unit's limit, or a skip with the reason."""
    unit = (ROOT / "systemd/swarmtalkd.service.in").read_text(encoding="utf-8")
    assert "\nMemoryMax=256M\n" in unit
    try:
        made = MemoryGroup(256 << 20)
    except OSError as error:
        pytest.skip(f"this kernel makes no control group with a limit of memory: {error}")
    yield made
    made.close()


@needs_other_user
@pytest.mark.field
def test_all_limits_used_up_at_once_need_less_than_the_unit_gives(group):
    users = (STRANGER, STRANGER - 1)
    with Daemon(preexec_fn=group.enter) as daemon:
        attacks = [daemon.attack("fill_everything", 48, SEED, uid=uid, stdin=subprocess.PIPE)
                   for uid in users]
        taken = [json.loads(attack.stdout.readline()) for attack in attacks]
        assert sum(each["clients"] for each in taken) == 60, taken
        for _ in range(20):
            assert daemon.status()["clients"] == 61
        assert daemon.cli("reload").returncode == 0
        print(f"{group.used_kib()} KiB of 262144 in use, {taken}")
        assert group.used_kib() < 250 * 1024
        assert group.killed() == 0
        for attack in attacks:
            attack.communicate("")


def go_on_though_nobody_reads_the_log():
    reader, writer = os.pipe()
    fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, 4096)
    with Daemon('[log]\nclient = "debug"\n', stderr=writer) as daemon:
        os.close(writer)
        for _ in range(200):
            Client(daemon.socket).take()
        assert daemon.counter("log_lines_lost") > 0
    os.close(reader)


def show_the_memory_of_a_daemon_with_a_key_to_nobody():
    own = pathlib.Path(tempfile.mkdtemp(dir="/tmp"))
    os.chmod(own, 0o755)
    key = own / "key"
    key.write_text("0123456789abcdef" * 4, encoding="ascii")
    os.chmod(key, 0o400)
    os.chown(key, STRANGER, STRANGER)
    readable = []
    for link in ("", f'key_file = "{key}"\n'):
        folder = tempfile.mkdtemp(dir="/tmp")
        os.chown(folder, STRANGER, STRANGER)
        with Daemon(link=link, folder=folder, user=STRANGER, group=STRANGER,
                    extra_groups=[]) as daemon:
            daemon.status()  # it serves, and has given up what it does not need
            done = subprocess.run(["cat", f"/proc/{daemon.process.pid}/environ"], user=STRANGER,
                                  group=STRANGER, extra_groups=[], capture_output=True, timeout=60)
            readable.append(done.returncode == 0)
    shutil.rmtree(own)
    assert readable == [True, False]  # for a process of the same user


@needs_other_user
@pytest.mark.field
def test_few_messages_are_told_as_sent_and_given_up_while_the_interface_is_full():
    """A slow interface in a namespace of its own, whose queue refuses most frames."""
    space = f"swarmtalk-hostile-{os.getpid()}"

    def ip(*words):
        done = subprocess.run(["ip", *words], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr

    ip("netns", "add", space)
    try:
        ip("-n", space, "link", "add", "wire", "type", "veth", "peer", "name", "end")
        ip("-n", space, "link", "set", "end", "up")
        ip("-n", space, "link", "set", "wire", "up")
        done = subprocess.run(["ip", "netns", "exec", space, "tc", "qdisc", "add", "dev", "wire",
                               "root", "tbf", "rate", "8kbit", "burst", "1600", "limit", "1600"],
                              capture_output=True, text=True, timeout=60)
        if done.returncode != 0:
            pytest.skip(f"this kernel makes no queue that is full: {done.stderr.strip()}")
        with Daemon(links='[links.w]\ntype = "raw_l2"\ninterface = "wire"\n',
                    command=["ip", "netns", "exec", space]) as daemon:
            client = Client(daemon.socket)
            client.take()
            publishers = [client.advertise(f"slow {number}", queue=16) for number in range(16)]
            for number in range(1, 17):
                for each in publishers:
                    body = field(1, each) + field(2, number) + field(3, 1200 * b"x")
                    client.socket.sendall(frame(field(11, body)))
            # What was built before the first refusal is given up after a second; then one frame at
            # a time is built, and no more messages are told as sent than that.
            queue, seen = 64, []

            def given_up():
                counters = daemon.status()["links"][0]["counters"]
                seen.append(counters.get("send_errors", 0))
                return len({count for count in seen if count > queue // 2}) > 1

            wait_for(given_up, "frames to be given up twice", timeout=60)
            assert seen[-1] <= queue + queue // 4
    finally:
        ip("netns", "del", space)


@pytest.mark.logic
def test_every_attack_that_is_measured_can_be_loaded():
    done = subprocess.run([ROOT / "benchmarks/hostile.py", "nothing"], capture_output=True,
                          text=True, timeout=60, check=False)
    assert done.returncode == 1 and not done.stdout
    assert re.fullmatch(r"benchmarks/hostile.py: no nothing; there are bad_origin, .*\n",
                        done.stderr)


def test_hostile_programs_harm_themselves_only():
    close_connections_without_a_process()
    let_floods_of_changes_cost_their_sender_only()
    go_on_though_nobody_reads_the_log()
    if os.geteuid() != 0:
        pytest.skip("passed but for its last three steps: being another user needs root")
    leave_places_channels_and_room_to_others()
    keep_places_for_operators()
    show_the_memory_of_a_daemon_with_a_key_to_nobody()
