"""The gateway's reports on its serial line, as frames and as text."""
import swarm

RUN = swarm.overhead("run@2.1", "stop@3.1")
QUIET = 3.2  # from here on the controller is silent
KIND_RECEPTION, KIND_HELLO, KIND_TEXT, KIND_VERSION = 1, 2, 3, 4


def crc16(data: bytes) -> int:
    """CRC-16/MCRF4XX."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0x8408 if crc & 1 else crc >> 1
    return crc


def decode_cobs(data: bytes) -> bytes:
    out = b""
    while data:
        block, data = data[1:data[0]], data[data[0]:]
        out += block + (b"\0" if data else b"")
    return out


def decode_frames(stream: bytes) -> list[bytes]:
    """Payloads of all whole frames; a wrong checksum fails."""
    payloads = []
    for piece in stream.split(b"\0")[:-1]:
        if not piece:
            continue
        whole = decode_cobs(piece)
        assert crc16(whole[:-2]) == int.from_bytes(whole[-2:], "little"), piece.hex()
        payloads.append(whole[:-2])
    return payloads


def gateway_between_beacons(tmp_path, name: str) -> swarm.Log:
    """A gateway with a beacon at 40 mm (uid 2) and one at 80 mm (uid 3): 39 and 79 in whole mm."""
    robots = swarm.grid(1, 3, 40, image=swarm.image("beacon"))
    robots[0]["image"] = swarm.image(name)
    return swarm.emulate(tmp_path, robots, ohc=RUN, seconds=6, seed=3, drift_ppm=10000)


def test_every_message_heard_is_reported_with_distance(tmp_path):
    log = gateway_between_beacons(tmp_path, "gateway")
    payloads = decode_frames(log.serial("k0"))
    assert [p[1] for p in payloads] == [i % 256 for i in range(len(payloads))]
    receptions = [p for p in payloads if p[0] == KIND_RECEPTION]
    sent = sum(log.sent(node, QUIET) for node in ("k1", "k2"))
    reported = len([e for e in decode_frames(log.serial("k0", QUIET)) if e[0] == KIND_RECEPTION])
    print(f"{reported} reports of {sent} messages")
    assert reported >= 0.95 * sent
    for payload in receptions:
        assert len(payload) == 19
        assert payload[13] == 0x10
        low, high = (int.from_bytes(payload[i:i + 2], "little") for i in (14, 16))
        assert 0 < low < high < 1024
        assert payload[18] == {2: 39, 3: 79}[payload[4]]


def test_the_gateway_says_hello_each_second_and_never_sends(tmp_path):
    log = gateway_between_beacons(tmp_path, "gateway")
    hellos = [p for p in decode_frames(log.serial("k0")) if p[0] == KIND_HELLO]
    assert 4 <= len(hellos) <= 6
    for payload in hellos:
        assert len(payload) == 12
        assert int.from_bytes(payload[4:6], "little") == 1  # uid
        assert payload[6] == 1  # version of the protocol
        assert int.from_bytes(payload[7:9], "little") == 0  # reports lost
        assert 500 < int.from_bytes(payload[9:11], "little") < 1024  # battery
    assert log.end("k0")["frames_started"] == 0


def test_text_lines(tmp_path):
    log = gateway_between_beacons(tmp_path, "gateway_text")
    lines = log.serial("k0").decode("ascii").split("\r\n")[:-1]
    reports = [line.split() for line in lines if line.startswith("01 ")]
    assert len(reports) > 50
    for fields in reports:
        assert len(fields) == 16
        uid, kind, distance = int(fields[3], 16), int(fields[12], 16), int(fields[15], 16)
        assert kind == 0x10
        assert distance == {2: 39, 3: 79}[uid]


def test_the_overhead_controller_reports_its_version_when_asked(tmp_path):
    """Which the stock one does not, and takes for the end of a repetition."""
    from overhead_frames import VERSION, frame, send_at
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3",
           "send": [send_at(2.1, frame(VERSION))]}
    log = swarm.emulate(tmp_path, swarm.grid(1, 1, 0, image=swarm.image("blank")), ohc=ohc,
                        seconds=2.4, seed=1)
    payloads = decode_frames(log.serial("ohc"))
    assert [p[0] for p in payloads] == [KIND_VERSION]
    report = payloads[0]
    assert (report[2], report[3], report[6]) == (1, 2, 3)  # product, version, flags
    assert int.from_bytes(report[4:6], "little") == 0xFF  # frame types 0 to 7
