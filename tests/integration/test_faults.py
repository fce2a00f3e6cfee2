"""What strangers and cables do to a daemon: it says so, and not more than once per second."""
import socket
import subprocess
import time

from conftest import needs_root, program, run, udp_port, wait_for

HELLO_OF_NO_TEXT = bytes.fromhex("05000000" "1203" "2201ff")  # Hello.name is not UTF-8


def start_daemon(tmp_path, **options):
    config = tmp_path / "d.toml"
    config.write_text('[links.w]\ntype = "udp"\ninterface = "lo"\n' + f"port = {udp_port()}\n")
    path = tmp_path / "d.sock"
    log = open(tmp_path / "log", "w", encoding="utf-8")
    daemon = subprocess.Popen([program("swarmtalkd"), "--config", config, "--socket", path],
                              stderr=log, **options)

    def accepts():  # the file is there a moment before anybody listens
        with socket.socket(socket.AF_UNIX) as client:
            return client.connect_ex(str(path)) == 0
    wait_for(accepts, what="the daemon to serve")
    return daemon, path, tmp_path / "log"


@needs_root
def test_strangers_and_cables_get_few_lines(bridge_lab, tmp_path):
    clients_that_send_garbage_do_not_fill_the_log(tmp_path)
    interface_that_flaps_gets_one_line_per_second(bridge_lab)
    port_without_permission_blames_the_port(tmp_path)


def clients_that_send_garbage_do_not_fill_the_log(tmp_path):
    daemon, path, log = start_daemon(tmp_path)
    try:
        for _ in range(300):
            with socket.socket(socket.AF_UNIX) as client:
                client.connect(str(path))
                client.sendall(HELLO_OF_NO_TEXT)
                while client.recv(4096):
                    pass
    finally:
        daemon.terminate()
        daemon.wait(60)
    lines = log.read_text().splitlines()
    assert len(lines) < 20, lines[:20]
    assert not any("[libprotobuf" in line for line in lines), lines


def interface_that_flaps_gets_one_line_per_second(bridge_lab):
    lab = bridge_lab(2)
    device = lab.status(1)["links"][0]["device"]
    log = next(lab.folder().glob("*1.log"))
    before = len(log.read_text().splitlines())
    inside = ["ip", "netns", "exec", lab.namespace(1), "sh", "-c",
              f"for i in $(seq 20); do ip link set {device} down; ip link set {device} up; done"]
    started = time.monotonic()
    assert run(*inside).returncode == 0
    wait_for(lambda: lab.status(1)["links"][0]["up"], what="link up again")
    time.sleep(1.2)
    seconds = time.monotonic() - started
    lines = log.read_text().splitlines()[before:]
    changes = [line for line in lines if device in line]
    assert 1 <= len(changes) <= seconds + 2, changes
    assert "up" in changes[-1], changes


def port_without_permission_blames_the_port(tmp_path):
    config = tmp_path / "d.toml"
    config.write_text('[links.w]\ntype = "udp"\ninterface = "lo"\nport = 80\n')
    tmp_path.chmod(0o777)
    for folder in list(tmp_path.parents)[:3]:
        if str(folder) not in ("/", "/tmp"):
            folder.chmod(0o755)
    done = run("unshare", "--net", "setpriv", "--reuid", "65534", "--regid", "65534",
               "--clear-groups", program("swarmtalkd"), "--config", config, "--socket",
               tmp_path / "d.sock")
    assert done.returncode == 1
    assert "d.toml:4: key 'links.w.port'" in done.stderr, done.stderr
    assert "no permission to use port 80; choose one from 1024 on" in done.stderr, done.stderr
