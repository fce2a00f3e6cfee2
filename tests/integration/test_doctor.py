"""`swarmtalk-cli doctor` on real wires: each test breaks one thing, and doctor names that alone.
What is named from which facts is held by tests/unit/cli/doctor."""
import csv
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys

import pytest
from conftest import ROOT, needs_root, next_line, one_line, program, run, wait_for
from wires import Wires

pytestmark = [needs_root, pytest.mark.field]

LINK = '[links.air]\ntype = "raw_l2"\ninterface = "a0"\n'
HEALTHY = LINK + "beacon_ms = 100\n"
WATCH_S = "0.6"  # beacons come every 100 ms
needs_nft = pytest.mark.skipif(not shutil.which("nft"), reason="nft is not installed (nftables)")


def node(number):
    return f"[node]\nid = {number}\n"


def standing(number):
    """A robot that knows where it is: 1.5 m from the one before."""
    return node(number) + f"pose = [{1.5 * number}, 0.0, 0.0]\n"


@pytest.fixture
def wires():
    with Wires() as made:
        made.wire("a")
        yield made


@pytest.fixture
def robot(wires):
    """Robot 1, healthy, on the wire "a"."""
    return wires.robot("a").start(standing(1) + HEALTHY)


@pytest.fixture
def pair(wires, robot):
    """Two healthy robots; robot 2 answers questions, and both have an IP address."""
    other = wires.robot("a").start(standing(2) + HEALTHY)
    for each in (robot, other):
        for words in (("link", "set", "lo", "up"),
                      ("address", "add", f"10.231.78.{each.number}/24", "dev", "a0")):
            assert each.execute("ip", *words).returncode == 0
    other.listen("ping", "--answer")
    return robot, other


def examine(robot, *words, code=None):
    """What doctor finds: ({id: finding}, its whole report). Notes are no findings."""
    done = robot.cli("doctor", "--json", "--period", WATCH_S, *words)
    assert done.stdout, done.stderr
    report = json.loads(done.stdout)
    found = {each["id"]: each for each in report["findings"] if each["severity"] != "note"}
    assert report["healthy"] == (not found), report
    assert done.returncode == ((1 if found else 0) if code is None else code), done.stderr
    for each in report["findings"]:
        assert "\n" not in each["what"] + each["remedy"] and each["what"] and each["remedy"]
    return found, report


def only(robot, name, *words):
    """The one finding there is, which has this name."""
    found, report = examine(robot, *words)
    assert list(found) == [name], json.dumps(report)
    return found[name]


@pytest.mark.clock
def test_a_healthy_pair_is_surveyed_and_an_interface_is_switched_on(wires, pair):
    a_healthy_robot_has_no_findings_and_doctor_says_what_it_looked_at(pair)
    a_survey_tells_loss_and_delay_by_distance_and_is_plotted(wires, pair[0])
    an_interface_that_is_switched_off_is_named_and_switched_on(pair[0])
    robots_with_one_hardware_address_hear_each_other_and_are_named(wires, pair)


def a_healthy_robot_has_no_findings_and_doctor_says_what_it_looked_at(pair):
    robot, other = pair
    for words in ((), ("--peer", 2, "--address", "10.231.78.2")):
        found, report = examine(robot, *words)
        assert found == {} and report["not_looked_at"] == [], report
    done = robot.cli("doctor", "--period", "0.1", "--peer", 2)
    assert done.returncode == 0
    result, _, *lines = done.stdout.splitlines()
    assert result == "all is well"
    looked_at = [line[len("ok: "):] for line in lines if line.startswith("ok: ")]
    assert looked_at[:2] == ["daemon", "configuration"]
    assert {"interface a0", "link air", "robot 2", "delay by DTIM",
            "conversion to unicast"} <= set(looked_at)
    assert examine(other)[0] == {}


def robots_with_one_hardware_address_hear_each_other_and_are_named(wires, pair):
    robot, other = pair
    address, = json.loads(robot.execute("ip", "-j", "link", "show", "a0").stdout)
    twin = wires.robot("a")
    for words in (("down",), ("address", address["address"]), ("up",)):
        assert twin.execute("ip", "link", "set", "a0", *words).returncode == 0
    wires.wait_for_wire(twin, "a")
    twin.start(standing(8) + HEALTHY)
    for each, number in ((robot, 8), (twin, 1)):
        line = f"hardware address {address['address']}: node {number};"
        wait_for(lambda log=each.logged, line=line: line in log(), what="the line")
        assert only(each, "address-twice")["subject"] == "a0"
    twin.listen("ping", "--answer")
    only(robot, "address-twice", "--peer", "8")
    assert examine(other)[0] == {}
    twin.stop()
    twin.start(node(1) + HEALTHY)  # a card that was copied whole
    wait_for(lambda: other.counter("duplicate_neighbours") == 1, what="the duplicate")
    assert only(other, "node-id-collision")["subject"] == "robot 1"
    wait_for(lambda: robot.counter("duplicate_node_ids") > 0, what="the namesake")
    assert set(examine(robot)[0]) == {"address-twice", "node-id-collision"}


def test_a_robot_whose_daemon_answers_is_healthy_without_a_program_there(wires, robot):
    """As installed: doctor's questions are no more than a daemon answers at once."""
    wires.robot("a").start(node(2) + HEALTHY + "[reserved]\nreport = true\n")
    found, report = examine(robot, "--peer", 2)
    assert found == {} and report["peer"]["answered"] == report["peer"]["asked"], report


def test_a_robot_alone_is_healthy(robot):
    found, report = examine(robot)
    assert found == {} and [each["id"] for each in report["findings"]
                            if each["id"] == "nobody-heard"] == ["nobody-heard"]


def an_interface_that_is_switched_off_is_named_and_switched_on(robot):
    robot.execute("ip", "link", "set", "a0", "down")
    wait_for(lambda: not robot.link("air")["up"], what="the link to go down")
    finding = only(robot, "interface-down")
    assert finding["subject"] == "a0" and "ip link set a0 up" in finding["remedy"]
    assert finding["fixed"] is None
    found, _ = examine(robot, "--fix", code=0)
    assert found["interface-down"]["fixed"] is True
    wait_for(lambda: robot.link("air")["up"], what="the link to come back")
    assert examine(robot)[0] == {}


def test_an_interface_that_is_gone_is_named(robot):
    robot.execute("ip", "link", "del", "a0")
    wait_for(lambda: not robot.link("air")["up"], what="the link to go down")
    assert only(robot, "interface-missing")["subject"] == "a0"


def test_an_interface_without_carrier_is_named(wires, robot):
    run("ip", "-n", f"{wires._prefix}a", "link", "set", "p1", "down")
    wait_for(lambda: not robot.link("air")["up"], what="the link to go down")
    assert only(robot, "no-carrier")["subject"] == "a0"


def test_a_small_mtu_is_named_and_set_right(pair):
    robot, _ = pair
    robot.execute("ip", "link", "set", "a0", "mtu", "600")
    wait_for(lambda: "MTU 600" in robot.link("air")["state"], what="the MTU")
    assert "600 bytes" in only(robot, "mtu-small")["what"]
    examine(robot, "--fix", code=0)
    wait_for(lambda: "MTU 1500" in robot.link("air")["state"], what="the MTU")
    assert examine(robot)[0] == {}


def test_a_robot_of_which_most_is_lost_is_named_and_its_mtu_compared(wires, pair):
    robot, other = pair
    other.execute("ip", "link", "set", "a0", "mtu", "1468")
    report = pathlib.Path(wires.file("report"))
    report.write_text(other.cli("doctor", "--json", "--period", WATCH_S).stdout)
    only(robot, "mtu-differs", "--peer", 2, "--peer-report", report)
    wires.lose("a", 0.8)

    def share():
        each, = json.loads(robot.cli("neighbours", "--json").stdout)["neighbours"]
        return each["loss"]

    wait_for(lambda: share() > 0.75, what="the loss")
    finding = only(robot, "neighbour-lossy")
    assert finding["subject"] == "link air" and "robot 2 " in finding["what"]


def test_a_program_at_a_serial_device_of_a_link_is_named(wires, robot):
    robot.stop()
    controller, device = os.openpty()
    path = os.ttyname(device)
    config = standing(1) + HEALTHY + (
        '[links.table]\ntype = "kilobot"\nprofile = "kilobot"\nuplink_form = "text"\n'
        f'text_channel = 9\nsettle_ms = 0\nuplink = "{path}"\ndownlink = "{path}"\n')
    robot.start(config)
    found, report = examine(robot)
    assert found == {} and path in report["looked_at"]
    robot.stop()
    thief = wires.keep(subprocess.Popen(["cat", path], stdout=subprocess.DEVNULL))
    held = pathlib.Path(f"/proc/{thief.pid}/fd")
    wait_for(lambda: path in map(os.path.realpath, held.iterdir()), what="the other program")
    robot.start(config)
    name = f"pid {thief.pid} (cat)"
    assert f"{path} is also open in {name}" in robot.link("table")["state"]
    assert name in robot.logged()
    finding = only(robot, "device-shared")
    assert finding["subject"] == path and name in finding["what"]
    thief.kill()
    thief.wait(timeout=60)
    assert examine(robot)[0] == {} and name not in robot.link("table")["state"]
    for each in (controller, device):
        os.close(each)


def test_a_user_outside_the_group_is_told(robot):
    os.chmod(pathlib.Path(robot.socket).parent, 0o755)
    os.chmod(robot.socket, 0o660)
    if run("setpriv", "--reuid", 65534, "--clear-groups", program("swarmtalk-cli"),
           "--version").returncode != 0:
        pytest.skip("the build folder is closed to other users")
    done = robot.execute("setpriv", "--reuid", 65534, "--regid", 65534, "--clear-groups",
                         program("swarmtalk-cli"), "--socket", robot.socket, "doctor", "--json")
    assert done.returncode == 1, done.stderr
    assert [each["id"] for each in json.loads(done.stdout)["findings"]
            if each["severity"] != "note"] == ["socket-permission"]


def test_a_wrong_configuration_is_named_with_its_line(robot):
    robot.configure(standing(1) + HEALTHY + "beacon = 3\n")
    assert "links.air.beacon" in only(robot, "configuration-wrong")["what"]
    # The daemon goes on, and the same is told where it does not run.
    robot.stop()
    found, _ = examine(robot, "--config", robot._config)
    assert sorted(found) == ["configuration-wrong", "daemon-absent"]
    assert "links.air.beacon" in found["configuration-wrong"]["what"]
    # A right file that is not for this machine.
    robot.configure('[node]\nid = "ip"\nid_interface = "nosuch0"\n' + HEALTHY)
    found, _ = examine(robot, "--config", robot._config)
    assert sorted(found) == ["configuration-wrong", "daemon-absent"]
    assert re.search(":3: key 'node.id_interface'", found["configuration-wrong"]["what"])


def test_a_configuration_that_is_not_in_force_is_named_and_reloaded(robot):
    robot.configure(standing(1) + LINK + "beacon_ms = 200\n")
    assert "links.air.beacon_ms" in only(robot, "configuration-changed")["what"]
    examine(robot, "--fix", code=0)
    assert examine(robot)[0] == {}
    robot.configure(standing(1) + LINK + "beacon_ms = 200\nethertype = 0x88b6\n")
    assert "ethertype" in only(robot, "configuration-needs-restart")["what"]
    os.unlink(robot._config)
    assert "cannot" in only(robot, "configuration-wrong")["what"]


def test_a_daemon_of_another_version_is_named(wires, tmp_path):
    version = run(program("swarmtalkd"), "--version").stdout.split()[-1]
    older = "9" + version[1:]
    binary = pathlib.Path(program("swarmtalkd")).read_bytes()
    assert version.encode() in binary
    copy = tmp_path / "swarmtalkd"
    copy.write_bytes(binary.replace(version.encode(), older.encode()))
    copy.chmod(0o755)
    robot = wires.robot("a").start(node(1) + HEALTHY, command=[copy])
    what = only(robot, "version-differs")["what"]
    assert older in what and version in what


def test_a_receive_buffer_that_the_kernel_cuts_is_named(wires):
    words = ["setpriv", "--bounding-set=-all,+net_raw", "--inh-caps=-all", program("swarmtalkd")]
    robot = wires.robot("a").start(node(1) + HEALTHY + "receive_buffer_bytes = 67108864\n",
                                   command=words)
    finding = only(robot, "receive-buffer")
    assert "67108864" in finding["what"] and "rmem_max" in finding["remedy"]


def test_a_daemon_that_does_not_run_is_named(robot):
    os.kill(robot.daemon.pid, 9)
    robot.daemon.wait(timeout=60)
    only(robot, "daemon-dead", "--config", robot._config)
    os.unlink(robot.socket)
    only(robot, "daemon-absent", "--config", robot._config)


def test_a_daemon_that_does_not_answer_is_named(robot):
    os.kill(robot.daemon.pid, signal.SIGSTOP)
    try:
        finding = only(robot, "daemon-silent", "--config", robot._config)
    finally:
        os.kill(robot.daemon.pid, signal.SIGCONT)
    assert "restart swarmtalkd" in finding["remedy"]


def test_two_robots_with_one_id_are_named(wires, robot):
    wires.robot("a").start(node(1) + HEALTHY)
    assert only(robot, "node-id-collision")["subject"] == "robot 1"


def test_two_others_with_one_id_are_named(wires, robot):
    for _ in range(2):
        wires.robot("a").start(node(7) + HEALTHY)
    wait_for(lambda: robot.counter("duplicate_neighbours") == 1, what="the duplicate")
    finding = only(robot, "node-id-collision")
    assert finding["subject"] == "robot 7" and " and " in finding["what"]


def test_robots_with_another_key_are_named(wires):
    for name in ("ours", "theirs"):
        assert run(program("swarmtalk-cli"), "keygen", wires.file(name)).returncode == 0
    ours, theirs = (f'key_file = "{wires.file(name)}"\n' for name in ("ours", "theirs"))
    robot = wires.robot("a").start(node(1) + HEALTHY + ours)
    found, _ = examine(robot)
    assert found == {}
    other = wires.robot("a").start(node(2) + HEALTHY + theirs)
    assert "frames_other_key" in only(robot, "other-key")["what"]
    other.stop()
    plain = wires.robot("a").start(node(3) + HEALTHY)
    assert "frames_without_key" in only(robot, "other-key")["what"]
    assert "frames_sealed" in only(plain, "other-key")["what"]


def test_robots_with_another_profile_are_named(wires, robot):
    wires.robot("a").start(node(2) + HEALTHY + 'profile = "kilobot"\n')
    assert "frames_other_profile" in only(robot, "other-profile")["what"]


def port(wires, number, *words):
    done = run("bridge", "-n", f"{wires._prefix}a", "link", "set", "dev", f"p{number}", *words)
    assert done.returncode == 0, done.stderr


def test_a_link_that_works_one_way_only_is_named_and_a_survey_of_it_has_no_losses(wires, pair):
    robot, other = pair
    port(wires, 2, "bcast_flood", "off", "mcast_flood", "off")
    assert only(robot, "peer-silent", "--peer", 2)["subject"] == "robot 2"
    deaf = pathlib.Path(wires.file("deaf"))
    deaf.write_text(other.cli("doctor", "--json", "--period", WATCH_S).stdout)
    finding = only(robot, "one-way", "--peer", 2, "--peer-report", deaf)
    assert finding["subject"] == "robot 2" and "does not hear this robot" in finding["what"]
    # From the other side robot 1 is silent; what robot 1's doctor says of itself tells why.
    robot.listen("ping", "--answer")
    report = pathlib.Path(wires.file("report"))
    report.write_text(robot.cli("doctor", "--json", "--period", WATCH_S).stdout)
    finding = only(other, "one-way", "--peer", 1, "--peer-report", report)
    assert "hears this robot, and is not heard" in finding["what"]
    assert list(examine(other, "--peer", 1)[0]) == ["peer-silent"]
    # Nothing comes through: lines without losses, and an error that says what to do.
    done = robot.cli("survey", "--peer", 2, "-C", 1, "--period", "0.3")
    assert done.returncode == 1
    one_line(done.stderr, "robot 2 has not answered", "ping --answer")
    row, = rows_of(done.stdout)
    assert (row["answered"], row["loss_there"], row["loss_back"]) == ("0", "", "")


@needs_nft
def test_a_filtered_ethertype_is_named(wires, pair):
    robot, _ = pair
    rules = ("table bridge f { chain c { type filter hook forward priority 0; "
             "ether type 0x88b5 drop; }; }")
    done = run("ip", "netns", "exec", f"{wires._prefix}a", "nft", rules)
    if done.returncode != 0:
        pytest.skip("this kernel has no nft tables for bridges: " + done.stderr)
    finding = only(robot, "ethertype-filtered", "--peer", 2, "--address", "10.231.78.2")
    assert "0x88b5" in finding["what"]


def test_filtered_multicast_is_named(wires):
    """Two robots on links of type udp, behind a switch that floods no multicast."""
    link = HEALTHY.replace("raw_l2", "udp")
    robots = [wires.robot("a") for _ in range(2)]
    for each in robots:
        for words in (("link", "set", "lo", "up"),
                      ("address", "add", f"10.231.78.{each.number}/24", "dev", "a0")):
            assert each.execute("ip", *words).returncode == 0
        each.start(node(each.number) + link)
    robots[1].listen("ping", "--answer")
    peer = ("--peer", 2, "--address", "10.231.78.2")
    assert examine(robots[0], *peer)[0] == {}
    for each in robots:
        port(wires, each.number, "mcast_flood", "off")
    only(robots[0], "multicast-filtered", *peer)


def test_clients_that_are_kept_apart_are_named(wires, pair):
    robot, _ = pair
    for number in (1, 2):
        port(wires, number, "isolated", "on")
    only(robot, "client-isolation", "--peer", 2, "--address", "10.231.78.2")
    assert list(examine(robot, "--peer", 2)[0]) == ["peer-silent"]


def test_another_ethertype_is_named_by_the_report_of_the_other(wires, robot):
    other = wires.robot("a").start(node(2) + HEALTHY + "ethertype = 0x88b6\n")
    report = pathlib.Path(wires.file("report"))
    report.write_text(other.cli("doctor", "--json", "--period", "0.1").stdout)
    finding = only(robot, "ethertype-differs", "--peer", 2, "--peer-report", report)
    assert "0x88b6" in finding["what"]


# An access point's way with broadcasts: held until a beacon, or sent to each client by itself.
ACCESS_POINT = """
import select, socket, sys, time
names, hold, targets = sys.argv[1:3], sys.argv[3] == "hold", sys.argv[4:6]
ports = []
for name in names:
    port = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
    port.bind((name, 3))
    ports.append(port)
waiting, beacon = [], 0.1024
print("ready", flush=True)
while True:
    now = time.monotonic()
    due = (int(now / beacon) + 1) * beacon
    readable, _, _ = select.select(ports, [], [], due - now if hold else None)
    for port in readable:
        frame, where = port.recvfrom(4096)
        if where[2] == socket.PACKET_OUTGOING:
            continue
        side = 1 - ports.index(port)
        if hold and frame[0] & 1:
            waiting.append((side, frame))
        elif frame[0] & 1 and targets:
            ports[side].send(bytes.fromhex(targets[side].replace(":", "")) + frame[6:])
        else:
            ports[side].send(frame)
    if hold and not readable:
        for side, frame in waiting:
            ports[side].send(frame)
        waiting = []
"""


def through_an_access_point(wires, pair, *words):
    """Puts a program of ours in the place of the wire."""
    full = f"{wires._prefix}a"
    for number in (1, 2):
        assert run("ip", "-n", full, "link", "set", f"p{number}", "nomaster").returncode == 0
        assert run("ip", "-n", full, "link", "set", f"p{number}", "promisc", "on").returncode == 0
    process = wires.keep(subprocess.Popen(
        ["ip", "netns", "exec", full, sys.executable, "-c", ACCESS_POINT, "p1", "p2", *words],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
    assert next_line(process) == "ready"


def test_broadcasts_that_wait_for_beacons_are_named(wires, pair):
    through_an_access_point(wires, pair, "hold")
    # On a busy machine our access point's beacons come late, which a real one's do not.
    for _ in range(5):
        found, report = examine(pair[0], "--peer", 2)
        assert set(found) <= {"multicast-delayed"}, report
        if found:
            break
    assert "102 ms" in found["multicast-delayed"]["what"]


def test_an_access_point_that_forwards_at_once_is_healthy(wires, pair):
    through_an_access_point(wires, pair, "at-once")
    assert examine(pair[0], "--peer", 2)[0] == {}


def test_broadcasts_that_are_made_unicast_are_named(wires, pair):
    macs = [json.loads(each.execute("ip", "-j", "link", "show", "a0").stdout)[0]["address"]
            for each in pair]
    through_an_access_point(wires, pair, "at-once", *macs)
    only(pair[0], "unicast-conversion", "--peer", 2)


def test_mistakes_are_one_line(robot, tmp_path):
    (tmp_path / "bad").write_text("{}")
    for words, code, pattern in (
            (("--peer", 1), 2, "robot 1 is this one"),
            (("--peer", 2, "--peer-report", tmp_path / "none"), 1, "cannot read"),
            (("--peer", 2, "--peer-report", tmp_path / "bad"), 1, "is not what")):
        done = robot.cli("doctor", "--period", "0.1", *words)
        assert done.returncode == code, (words, done.stderr)
        one_line(done.stderr, pattern)


@pytest.mark.logic
@pytest.mark.parametrize("words, pattern", [
    (("--peer", 0), "--peer"), (("--address", "10.0.0.1"), "--peer"),
    (("--country", "Germany"), "two letters"), (("--mode", "wired"), "--mode")])
def test_command_lines_that_cannot_be_meant_are_one_line(words, pattern):
    done = run(program("swarmtalk-cli"), "doctor", *words)
    assert done.returncode == 2
    one_line(done.stderr, pattern)


@pytest.mark.logic
def test_every_finding_is_documented_and_every_documented_one_exists():
    sources = (ROOT / "cli/doctor").glob("diagnose*.cpp")
    code = "".join(path.read_text() for path in sources)
    made = set(re.findall(r'report\.add\(\s*\{"([a-z-]+)"', code))
    made |= set(re.findall(r'^\s*\{"frames_\w+", "([a-z-]+)",', code, re.M))
    made |= set(re.findall(r'"(daemon-[a-z]+)"', code)) | {"lossy"}
    text = (ROOT / "docs/doctor.md").read_text()
    rows = "".join(re.findall(r"^\| (`.*?) \|", text, re.M))
    notes = re.search(r"^Notes, .*?\n\n", text, re.M | re.S)[0]
    told = set(re.findall(r"`([a-z]+(?:-[a-z]+)*)`", rows)) | set(
        re.findall(r"`([a-z]+(?:-[a-z]+)+)` \(", notes))
    assert made == told


def rows_of(text):
    rows = list(csv.DictReader(text.splitlines()))
    assert list(rows[0]) == ["time_unix_s", "distance_m", "asked", "heard_there", "answered",
                             "loss_there", "loss_back", "round_trip_ms", "signal_dbm"]
    return rows


def a_survey_tells_loss_and_delay_by_distance_and_is_plotted(wires, robot):
    file = wires.file("survey.csv")
    done = robot.cli("survey", "--peer", 2, file, "-C", 3, "--period", "0.5")
    assert (done.returncode, done.stderr) == (0, "")
    rows = rows_of(pathlib.Path(file).read_text())
    assert len(rows) == 3
    for row in rows:
        assert float(row["distance_m"]) == pytest.approx(1.5, abs=0.01)
        assert 0 < int(row["answered"]) <= int(row["heard_there"]) <= int(row["asked"])
        assert 0 <= float(row["loss_there"]) < 1 and 0 <= float(row["loss_back"]) < 1
        assert float(row["round_trip_ms"]) > 0 and row["signal_dbm"] == ""
    matplotlib = run("/usr/bin/python3", "-c", "import matplotlib")
    if matplotlib.returncode == 0:
        code = re.search(r"<!-- survey plot -->\n```python\n(.*?)```",
                         (ROOT / "docs/doctor.md").read_text(), re.S)[1]
        done = run("/usr/bin/python3", "-c", code, file, wires.file("survey.svg"), timeout=120)
        assert done.returncode == 0, done.stderr
        assert "<svg" in pathlib.Path(wires.file("survey.svg")).read_text()
