"""The Python client with every Python that can be had, and against what is written in C++."""
import asyncio
import json
import subprocess

import pytest
from conftest import BUILD, HERE, find_python, newer_pythons
from daemons import CLI, CLIENT

import swarmtalk

PATIENCE_S = 60


def behave_with(python):
    done = subprocess.run([python, "-W", "error::ResourceWarning", str(HERE / "behaviour")],
                          capture_output=True, text=True, timeout=250)
    print(python, done.stderr.strip().splitlines()[-1])
    assert done.returncode == 0, f"{python}: {done.stderr}"


@pytest.mark.field
def test_robots_in_python_2_behave():
    behave_with(find_python("python2.7"))


def end_with_a_mistake(python, tmp_path):
    program = tmp_path / "program.py"
    program.write_text("import swarmtalk\nswarmtalk.Client('x', '/nowhere/s')\n")
    done = subprocess.run([python, program], capture_output=True, text=True,
                          env={"PYTHONPATH": CLIENT, "PYTHONDONTWRITEBYTECODE": "1"}, timeout=60)
    assert done.returncode == 1
    assert done.stderr.strip().splitlines()[-1].endswith(
        "cannot reach swarmtalkd: /nowhere/s does not exist; start swarmtalkd for that socket")


@pytest.mark.logic
def test_a_mistake_at_the_end_is_a_traceback_and_exit_code_1(tmp_path):
    end_with_a_mistake("/usr/bin/python3", tmp_path)


@pytest.mark.field
def test_so_it_is_in_python_2(tmp_path):
    end_with_a_mistake(find_python("python2.7"), tmp_path)


def frames_of_cpp():
    done = subprocess.run([str(BUILD / "tests/python/golden_frames")], capture_output=True,
                          text=True, timeout=60, check=True)
    return {name: bytes.fromhex(text) for name, text in map(str.split, done.stdout.splitlines())}


class Recorder(swarmtalk.Client):
    """A client without a daemon, whose bytes are looked at."""

    def __init__(self):
        super().__init__("grüß", "/nowhere", connect=False)
        self._started, self._phase = True, 3

    def _flush(self):
        pass

    def close(self):
        """Nothing is open, also where the program ends."""

    def take_bytes(self):
        taken, self._outgoing = bytes(self._outgoing), bytearray()
        return taken


@pytest.mark.logic
def test_its_frames_are_those_of_protobuf_byte_for_byte():
    golden = frames_of_cpp()
    client = Recorder()
    made = {}
    client._append(swarmtalk._bytes(2, swarmtalk._uint(1, 1) + swarmtalk._uint(2, 2)
                                    + swarmtalk._bytes(4, client._name)))
    made["hello"] = client.take_bytes()
    subscriber = swarmtalk.Subscriber(client, "c", None, 1.5, True, 300, True, 2.5, False)
    client._request(subscriber._request(), None)
    made["subscribe"] = client.take_bytes()
    publisher = swarmtalk.Publisher(client, 65535, 4, True, 200, True, 3, 0.15, None, 12)
    client._request(publisher._request(), None)
    made["advertise"] = client.take_bytes()
    plain = swarmtalk.Publisher(client, 0, None, None, 16, False, 1, None, None)
    client._request(plain._request(), None)
    made["advertise_plain"] = client.take_bytes()
    follows = swarmtalk.Publisher(client, 1, None, None, 0, False, 1, None, None, "auto")
    client._request(follows._request(), None)
    made["advertise_auto"] = client.take_bytes()
    client._pending.clear()
    client.set_fixed_pose(-1.25, 2, 3.1415927)
    made["set_pose"] = client.take_bytes()
    plain._registered({9: bytearray.fromhex("08c801100018808001280020ff01")})
    plain.send(b"x" * 200, ttl=0)
    made["publish"] = client.take_bytes()
    plain.send(b"")
    made["publish_nothing"] = client.take_bytes()
    subscriber._id, subscriber._unreported_loss, client._has_unreported_loss = 7, 1000, True
    client._handles.append(subscriber)
    client._report_losses()
    made["client_loss"] = client.take_bytes()
    plain._unreported_refused, client._has_unreported_loss = 300, True
    client._handles[:] = [plain]
    client._report_losses()
    made["client_refused"] = client.take_bytes()
    for name, frame in made.items():
        assert frame.hex() == golden[name].hex(), name
    assert set(golden) - set(made) == {"deliver", "deliver_nothing"}


@pytest.mark.logic
def test_it_reads_a_delivery_as_protobuf_wrote_it():
    golden = frames_of_cpp()

    def read(name):
        frame = bytearray(golden[name])
        envelope = dict(swarmtalk._fields(frame, 4, len(frame)))
        return swarmtalk.Message(swarmtalk._fields(envelope[13], 0, len(envelope[13])))
    message = read("deliver")
    assert message.data == b"\0\xff\n"
    assert (message.channel, message.sender, message.message_number) == (41000, 65534, 4000000000)
    assert (message.distance, message.bearing) == (0.5, -1.25)
    assert message.sender_pose == swarmtalk.Pose(-3.5, 0, 1.5, 1.5)
    assert (message.transmitter, read("deliver_nothing").transmitter) == (8, 0)
    assert (message.hops, message.ttl, message.local, message.epoch) == (2, 5, True, 4294967295)
    assert message.delay == 1.5
    assert message.received_at == pytest.approx(123456789.012345678)
    assert message.lost_before == swarmtalk.Loss(1, 2, 3, 0, 4)
    assert message.origin == ("serial", 9, 77)
    nothing = read("deliver_nothing")
    assert nothing.data == b"" and not nothing.has_distance and not nothing.lost_before
    assert nothing.delay is None and nothing.sender_pose is None and nothing.origin is None


def hear_cpp_and_be_heard_by_it(two_robots):
    with swarmtalk.Client("p", two_robots[0].socket) as robot:
        robot.set_fixed_pose(0, 0, 0)
        robot.sync()
        subprocess.run([CLI, "--socket", two_robots[1].socket, "pose", "set", "3", "4", "0"],
                       check=True, timeout=PATIENCE_S)
        sub = subprocess.Popen([CLI, "--socket", two_robots[1].socket, "sub", "c", "--json", "-C",
                                "2", "-W", "60"], stdout=subprocess.PIPE, text=True)
        with swarmtalk.Client("q", two_robots[1].socket) as other:
            while not other.status().channels:
                other.run(0.02)
        publisher = robot.advertise("c")
        payload = bytes(range(256))
        assert publisher.send("grüß") and publisher.send(payload)
        heard = [json.loads(line) for line in sub.communicate(timeout=90)[0].splitlines()]
        assert heard[0]["text"] == "grüß" and heard[1]["hex"] == payload.hex()
        assert heard[0]["sender"] == 1 and heard[0]["distance_m"] == pytest.approx(5, abs=0.01)
        subscriber = robot.subscribe("d")
        subprocess.run([CLI, "--socket", two_robots[1].socket, "pub", "d", "00ff0a", "--hex"],
                       check=True, timeout=PATIENCE_S)
        message = subscriber.get(PATIENCE_S)
        assert message.data == b"\x00\xff\n" and message.sender == 2
        assert message.distance == pytest.approx(5, abs=0.01)


def hear_and_send_in_asyncio_until_the_daemon_goes(two_robots):
    async def scene():
        with swarmtalk.Client("a", two_robots[0].socket) as robot, \
                swarmtalk.Client("b", two_robots[1].socket) as other:
            subscriber = other.subscribe("c")
            publisher = robot.advertise("c", sent=True)

            async def talk():
                for number in range(5):
                    await publisher.async_send(str(number))
            talking = asyncio.ensure_future(talk())
            heard = []
            async for message in subscriber:
                heard.append(message.text)
                if len(heard) == 5:
                    subscriber.close()
            await talking
            assert heard == list("01234")
            with pytest.raises(swarmtalk.Error, match="at most 16384"):
                await publisher.async_send(b"x" * 20000)
            with pytest.raises(swarmtalk.Error, match="sent=True"):
                await robot.advertise("d").async_send(b"")
            two_robots[0].kill()
            slow = robot.advertise("e", sent=True)
            with pytest.raises(swarmtalk.Error) as caught:
                await slow.async_send("x")
            assert caught.value.code in ("disconnected", "no_daemon", "daemon_dead")
    asyncio.run(asyncio.wait_for(scene(), 60))


def serve_one_event_loop_after_the_other(two_robots):
    with swarmtalk.Client("a", two_robots[0].socket) as robot, \
            swarmtalk.Client("b", two_robots[1].socket) as other:
        subscriber = robot.subscribe("c")
        publisher = other.advertise("c", sent=True)

        async def hear(text):
            waiting = asyncio.ensure_future(anext_of(subscriber))
            await publisher.async_send(text)
            assert (await waiting).text == text
            asyncio.ensure_future(anext_of(subscriber))  # is cancelled with its loop

        async def anext_of(each):
            async for message in each:
                return message
        for text in ("first", "second", "third"):
            asyncio.run(asyncio.wait_for(hear(text), PATIENCE_S))
        with pytest.raises(swarmtalk.BadArgument, match="need a running event loop"):
            robot.attach()

        async def beside():
            robot.attach()
            with pytest.raises(swarmtalk.BadArgument, match="a Client for each loop"):
                robot.attach(asyncio.new_event_loop())
        asyncio.run(beside())


def test_robots_in_python_behave_and_talk_with_cpp(two_robots):
    for python in ["/usr/bin/python3", *newer_pythons()]:
        behave_with(python)
    hear_cpp_and_be_heard_by_it(two_robots)
    serve_one_event_loop_after_the_other(two_robots)
    hear_and_send_in_asyncio_until_the_daemon_goes(two_robots)
