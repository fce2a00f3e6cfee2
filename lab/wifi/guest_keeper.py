"""Keeps one Wi-Fi guest: starts QEMU, passes commands between its clients (a Unix socket in the
guest's folder) and the agent inside (one virtio serial port), and takes everything away when it
ends, or when whoever started it does, however that ends.

    guest_keeper.py FOLDER --radios N [--memory MB] [--module NAME...] [--stay]

Prints "ready" when the agent answers, else one line with the reason. It ends when a client asks for
it (a frame Q), and without --stay when its standard input ends. Clients speak the agent's frames;
their session numbers are replaced by its own.
"""
import argparse
import asyncio
import ctypes
import os
import pathlib
import shutil
import signal
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import guest_image  # noqa: E402

HEADER = struct.Struct(">IcI")
BOOT_TIMEOUT_S = 180
END_GRACE_S = 3
MAX_WAITING = 64 << 20  # bytes that a client may leave unread before it is thrown out
PR_SET_PDEATHSIG = 1
AGENT = pathlib.Path(__file__).resolve().parent / "guest_agent.py"


def die_with_parent():
    """In QEMU, between fork and exec: it is killed when the keeper is."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def qemu_command(folder: pathlib.Path, kernel: pathlib.Path, memory_mb: int) -> list[str]:
    """Emulated (TCG): KVM is not asked for, so that it is the same everywhere. The processor has
    what is emulated well: no vectors of 32 bytes, which the C library would use, but AES and random
    numbers. Its time stamp counter is the machine's; not told so, the kernel finds it too far from
    a watchdog that is emulated as well, and reads a slow clock from then on."""
    options = {
        "-accel": ["tcg"], "-cpu": ["Westmere,+rdrand,+rdseed"], "-smp": ["1"],
        "-m": [str(memory_mb)],
        "-kernel": [str(kernel)], "-initrd": [str(folder / "initramfs")],
        "-append": ["console=ttyS0 quiet loglevel=3 panic=-1 rdinit=/init mitigations=off "
                    "tsc=reliable random.trust_cpu=on cryptomgr.notests audit=0 apparmor=0"],
        "-display": ["none"], "-monitor": ["none"], "-nic": ["none"],
        "-serial": [f"file:{folder}/console.log"],
        "-chardev": [f"socket,id=port,path={folder}/port.sock"],
        "-fsdev": ["local,id=host,path=/,security_model=none,readonly=on,multidevs=remap",
                   f"local,id=folder,path={folder},security_model=none"],
        "-device": ["virtio-9p-pci,fsdev=host,mount_tag=host",
                    "virtio-9p-pci,fsdev=folder,mount_tag=folder",
                    "virtio-serial-pci", "virtserialport,chardev=port,name=swarmtalk"],
    }
    words = ["qemu-system-x86_64", "-nodefaults", "-no-user-config", "-no-reboot"]
    for name, values in options.items():
        for value in values:
            words += [name, value]
    return words


class Keeper:
    def __init__(self, folder: pathlib.Path, options):
        self.folder, self.options = folder, options
        self.qemu = None
        self.port = None  # the writer to the agent
        self.ready = asyncio.Event()
        self.ending = asyncio.Event()
        self.clients = {}  # session inside -> (writer, the client's number)
        self.numbers = iter(range(1, 1 << 32))

    async def read_frames(self, reader: asyncio.StreamReader, handle):
        try:
            while True:
                number, kind, length = HEADER.unpack(await reader.readexactly(HEADER.size))
                handle(number, kind, await reader.readexactly(length))
        except (asyncio.IncompleteReadError, ConnectionError, asyncio.CancelledError):
            pass  # the other end has gone, or all of this ends

    async def agent_connects(self, reader, writer):
        self.port = writer
        await self.read_frames(reader, self.from_agent)
        self.ending.set()

    def from_agent(self, session, kind, content):
        if kind == b"A":
            self.ready.set()
            return
        writer, number = self.clients.get(session, (None, 0))
        if kind == b"X":
            self.clients.pop(session, None)
        if writer is None or writer.is_closing():
            return
        if writer.transport.get_write_buffer_size() > MAX_WAITING:
            writer.transport.abort()
            return
        writer.write(HEADER.pack(number, kind, len(content)) + content)

    async def client_connects(self, reader, writer):
        own = {}  # its number -> session inside

        def from_client(number, kind, content):
            if kind == b"Q":
                self.ending.set()
            elif kind == b"S":
                if not self.ready.is_set():
                    writer.close()  # there is nothing yet to run it
                    return
                own[number] = next(self.numbers)
                self.clients[own[number]] = (writer, number)
            if number in own:
                self.to_agent(own[number], kind, content)

        await self.read_frames(reader, from_client)
        for session in own.values():
            if self.clients.pop(session, None):
                self.to_agent(session, b"K", bytes([signal.SIGKILL]))
        writer.close()

    def to_agent(self, session, kind, content):
        if self.port is not None and not self.port.is_closing():
            self.port.write(HEADER.pack(session, kind, len(content)) + content)

    async def watch_input(self):
        """Ends when whoever started this has gone."""
        await asyncio.get_running_loop().run_in_executor(None, sys.stdin.buffer.read)
        self.ending.set()

    def make_image(self) -> pathlib.Path:
        kernel = guest_image.find_kernel()
        settings = {"FOLDER": str(self.folder), "AGENT": str(AGENT),
                    "PYTHON": os.path.realpath(sys.executable),
                    "RADIOS": str(self.options.radios)}
        content = guest_image.initramfs(kernel, settings, self.options.module)
        (self.folder / "initramfs").write_bytes(content)
        return kernel.image

    async def run(self) -> str:
        """@return why it ended early, one line; empty: it was asked to"""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            loop.add_signal_handler(number, self.ending.set)
        await asyncio.start_unix_server(self.client_connects, self.folder / "control.sock")
        kernel = self.make_image()
        port = await asyncio.start_unix_server(self.agent_connects, self.folder / "port.sock")
        self.qemu = await asyncio.create_subprocess_exec(
            *qemu_command(self.folder, kernel, self.options.memory), preexec_fn=die_with_parent,
            stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.DEVNULL,
            stderr=open(self.folder / "qemu.log", "wb"))
        waits = [loop.create_task(self.qemu.wait()), loop.create_task(self.ending.wait())]
        if not self.options.stay:
            watching = loop.create_task(self.watch_input())  # noqa: F841  # a task needs an owner
        up = loop.create_task(self.ready.wait())
        await asyncio.wait([up, *waits], timeout=BOOT_TIMEOUT_S,
                           return_when=asyncio.FIRST_COMPLETED)
        if not self.ready.is_set():
            was_told = self.ending.is_set() and self.qemu.returncode is None
            return "" if was_told else self.last_words()
        port.close()
        print("ready", flush=True)
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        return ""

    def last_words(self) -> str:
        for name in ("qemu.log", "console.log"):
            path = self.folder / name
            lines = path.read_text(errors="replace").split("\n") if path.exists() else []
            lines = [line.strip() for line in lines if line.strip()]
            if lines:
                return f"the guest does not come up: {lines[-1]}"
        return f"the guest does not come up within {BOOT_TIMEOUT_S} s, and says nothing"

    async def end(self):
        if self.qemu is not None and self.qemu.returncode is None:
            self.qemu.terminate()
            try:
                await asyncio.wait_for(self.qemu.wait(), END_GRACE_S)
            except asyncio.TimeoutError:
                self.qemu.kill()
                await self.qemu.wait()


async def keep(options) -> int:
    folder = pathlib.Path(options.folder).resolve()
    keeper = Keeper(folder, options)
    try:
        problem = await keeper.run()
    except guest_image.Unavailable as reason:
        problem = str(reason)
    finally:
        await keeper.end()
        shutil.rmtree(folder, ignore_errors=True)
    if problem:
        print(problem, flush=True)
    return 1 if problem else 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder")
    parser.add_argument("--radios", type=int, required=True)
    parser.add_argument("--memory", type=int, default=768)
    parser.add_argument("--module", action="append", default=[])
    parser.add_argument("--stay", action="store_true")
    code = asyncio.run(keep(parser.parse_args()))
    sys.stdout.flush()
    os._exit(code)  # a thread may still wait for standard input


if __name__ == "__main__":
    main()
