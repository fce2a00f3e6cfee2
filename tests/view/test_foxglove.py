"""The Foxglove WebSocket protocol: by hand and protoc (in the story of test_view.py), and by the
official npm packages."""
import base64
import fcntl
import json
import os
import pathlib
import shutil
import struct
import subprocess

import pytest
from conftest import BUILD, ROOT, run
from websocket import WebSocket

SUBPROTOCOLS = ("foxglove.websocket.v1", "foxglove.sdk.v1")
PACKAGES = ("@foxglove/ws-protocol@0.8.0", "@foxglove/schemas@1.8.0", "ws@8.23.0",
            "protobufjs@7.6.6")
HERE = pathlib.Path(__file__).resolve().parent


def config(tmp_path):
    path = tmp_path / "base.toml"
    path.write_text("[links.wifi]\nbeacon_ms = 100\n[reserved]\ndebug = true\n")
    return "--config", path


@pytest.fixture(name="lab_and_view")
def fixture_lab_and_view(make_lab, make_view, tmp_path):
    lab = make_lab(4, *config(tmp_path))
    view = make_view(lab.socket(1))
    return lab, view


def advertised(viewer):
    """Channels by topic, after the server has said who it is."""
    info = json.loads(viewer.receive())
    assert (info["op"], info["name"], info["capabilities"]) == ("serverInfo", "swarmtalk-view", [])
    message = json.loads(viewer.receive())
    assert message["op"] == "advertise"
    return {channel["topic"]: channel for channel in message["channels"]}


def decoded(channel, payload, tmp_path):
    """The message as protoc writes it, by the schema that was advertised."""
    schema = tmp_path / "schema.bin"
    schema.write_bytes(base64.b64decode(channel["schema"]))
    done = subprocess.run(["protoc", f"--descriptor_set_in={schema}",
                           f"--decode={channel['schemaName']}"], input=payload,
                          capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.decode()


def payloads(viewer, subscriptions, count=200):
    """The first message of each subscription."""
    found = {}
    for _ in range(count):
        message = viewer.receive()
        if isinstance(message, str):
            continue
        kind, subscription, stamp = struct.unpack("<BIQ", message[:13])
        assert kind == 1 and stamp > 1_600_000_000 * 10**9
        found.setdefault(subscription, message[13:])
        if set(subscriptions) <= set(found):
            return found
    raise AssertionError(f"only {sorted(found)} of {subscriptions} came")


def decode_every_advertised_channel(lab, view, subprotocol, tmp_path):
    with WebSocket(view.port, protocol=subprotocol) as viewer:
        assert f"Sec-WebSocket-Protocol: {subprotocol}" in viewer.head
        channels = advertised(viewer)
        assert {t: c["schemaName"] for t, c in channels.items()} == {
            "/swarm": "foxglove.SceneUpdate", "/tf": "foxglove.FrameTransforms",
            "/robots": "swarmtalk.Robots", "/log": "foxglove.Log"}
        assert lab.cli(2, "pub", "debug", "tired").returncode == 0
        ids = {70 + channel["id"]: channel for channel in channels.values()}
        viewer.send(json.dumps({"op": "subscribe", "subscriptions": [
            {"id": number, "channelId": channel["id"]} for number, channel in ids.items()]}))
        texts = {}
        for _ in range(100):  # until all four robots have been heard
            for number, payload in payloads(viewer, list(ids)[:3]).items():
                texts[ids[number]["topic"]] = decoded(ids[number], payload, tmp_path)
            if all(f'child_frame_id: "robot/{n}"' in texts["/tf"] for n in (1, 2, 3, 4)):
                break
    scene = texts["/swarm"]
    for number in (1, 2, 3, 4):
        assert f'id: "robot/{number}"' in scene and f'text: "{number}"' in scene
    assert "type: LINE_LIST" in scene and "lifetime" in scene
    assert "x_m: 0.5" in texts["/robots"]


def read_log_lines(lab, view, tmp_path):
    with WebSocket(view.port, protocol=SUBPROTOCOLS[0]) as viewer:
        channel = advertised(viewer)["/log"]
        viewer.send(json.dumps({"op": "subscribe", "subscriptions": [
            {"id": 5, "channelId": channel["id"]}]}))
        assert lab.cli(2, "pub", "debug", "tired").returncode == 0
        text = decoded(channel, payloads(viewer, [5])[5], tmp_path)
    assert 'message: "tired"' in text and 'name: "robot/2"' in text and "level: INFO" in text


def unsubscribe_and_talk_nonsense(view):
    with WebSocket(view.port, protocol=SUBPROTOCOLS[0]) as viewer:
        channels = advertised(viewer)
        tf = channels["/tf"]["id"]
        viewer.send(json.dumps({"op": "subscribe",
                                "subscriptions": [{"id": 5, "channelId": tf}]}))
        payloads(viewer, [5])
        viewer.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [5]}))
        for text in ("nonsense", '{"op":"advertise","channels":[]}',
                     '{"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]}',
                     '{"op":"subscribe","subscriptions":[7]}', b"\x01\x02"):
            viewer.send(text)
        answers = 0
        while answers < 5:
            message = viewer.receive()
            if isinstance(message, str):
                assert json.loads(message)["op"] == "status"
                answers += 1
            else:
                assert answers == 0, "a message came after its subscription had ended"


def find_the_topics_of_the_layout(view):
    layout = json.loads((ROOT / "view/swarmtalk-layout.json").read_text())
    with WebSocket(view.port, protocol=SUBPROTOCOLS[0]) as viewer:
        topics = set(advertised(viewer))
    named = set()
    for panel in layout["configById"].values():
        named |= set(panel.get("topics", {}))
        paths = [panel[key] for key in ("topicPath", "topicToRender") if key in panel]
        named |= {path.split(".")[0] for path in paths}
    assert len(named) == 3 and named <= topics


def serve_a_foxglove_client(lab, view, tmp_path):
    for subprotocol in SUBPROTOCOLS:
        decode_every_advertised_channel(lab, view, subprotocol, tmp_path)
    read_log_lines(lab, view, tmp_path)
    unsubscribe_and_talk_nonsense(view)
    find_the_topics_of_the_layout(view)


@pytest.fixture(name="packages", scope="session")
def fixture_packages():
    """A folder with the npm packages, kept in the build folder."""
    if shutil.which("node") is None or shutil.which("npm") is None:
        pytest.skip("node or npm is missing: apt-get install npm")
    folder = BUILD / "npm"
    folder.mkdir(exist_ok=True)
    lock = open(folder / "lock", "w", encoding="utf-8")  # the tests run side by side
    fcntl.flock(lock, fcntl.LOCK_EX)
    complete = folder / "complete"
    if not complete.exists() or complete.read_text() != " ".join(PACKAGES):
        try:
            done = subprocess.run(["npm", "install", "--no-audit", "--no-fund", "--prefix", folder,
                                   *PACKAGES], capture_output=True, text=True, timeout=120,
                                  check=False)
        except subprocess.TimeoutExpired:
            pytest.skip("the npm packages cannot be had: npm timed out")
        if done.returncode != 0:
            last = (done.stderr.strip().splitlines() or ["npm failed"])[-1]
            pytest.skip(f"the npm packages cannot be had: {last}")
        complete.write_text(" ".join(PACKAGES))
    lock.close()
    return folder / "node_modules"


def node(packages, script, *arguments):
    return run("node", HERE / script, *arguments, env={**os.environ, "NODE_PATH": str(packages)})


@pytest.mark.field
@pytest.mark.parametrize("subprotocol", SUBPROTOCOLS)
def test_the_official_client_decodes_every_channel(lab_and_view, packages, subprotocol):
    lab, view = lab_and_view
    assert lab.cli(2, "pub", "debug", "tired").returncode == 0
    done = node(packages, "foxglove_client.js", view.port, subprotocol)
    assert done.returncode == 0, done.stderr
    received = json.loads(done.stdout)
    assert sorted(received) == ["/log", "/robots", "/swarm", "/tf"]
    assert received["/log"]["message"] == "tired"
    assert [robot["id"] for robot in received["/robots"]["robots"]][0] == 1


@pytest.mark.field
def test_our_schemas_are_those_of_foxglove(packages):
    done = node(packages, "foxglove_schemas.js", ROOT / "view/scene/foxglove.proto")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.strip().splitlines()
    assert len(lines) == 1 and int(lines[0].split()[0]) > 50, done.stdout
