"""Programs that look at swarmtalk-view as its page does."""
import json
import time

from websocket import WebSocket

PAGE = "swarmtalk.view.v1"


def page(view, **options):
    return WebSocket(view.port, protocol=PAGE, **options)


def message_where(viewer, condition, timeout=60.0, what="message"):
    """The first message for which the condition holds."""
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        message = json.loads(viewer.receive())
        if condition(message):
            return message
    raise AssertionError(f"timed out waiting for {what}")


def robots_of(state):
    return {robot["id"]: robot for robot in state["robots"]}


def state_with(viewer, *ids, timeout=60.0):
    """A state in which these robots have a place."""
    return message_where(viewer, lambda m: m["t"] == "state" and all(
        "x" in robots_of(m).get(number, {}) for number in ids), timeout, f"robots {ids}")


def beacons(tmp_path, text=""):
    """Options for a lab whose silent robots send ten beacons a second."""
    path = tmp_path / "base.toml"
    path.write_text("[links.wifi]\nbeacon_ms = 100\n" + text)
    return "--config", path


def status_of_channels(lab, robot):
    return json.loads(lab.cli(robot, "status", "--json").stdout)["channels"]


def channels_of(lab, robot):
    """Names, else numbers, of the channels that programs of a robot use."""
    return {str(each["name"] or each["number"]) for each in status_of_channels(lab, robot)}


def watch(viewer, channel):
    viewer.send(json.dumps({"op": "watch", "channel": channel}))
