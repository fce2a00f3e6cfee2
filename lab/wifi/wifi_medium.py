"""The air between a guest's radios: our own medium (lab/wifi/medium) instead of the kernel's, which
loses nothing. While it runs, frames are lost by distance and rate, and by what is set here.
"""
import json

from wifi_guest import Guest, GuestError

ANSWER_S = 30


class Medium:
    """Runs from when it is made until close(); the kernel's medium takes over again then."""

    def __init__(self, guest: Guest, program: str, places=None, seed: int = 1):
        """@param program  swarmtalk-wifi-medium of a build
        @param places   radio -> (x, y) in metres; the others stand at (0, 0)"""
        self.guest = guest
        names = [*guest.robots, *(f"ap{n}" for n in range(1, guest.access_points + 1))]
        places = places or {}
        words = []
        for number, name in enumerate(names):
            x, y = places.get(name, (0, 0))
            # The second address of a simulated radio is what its driver is known by.
            words.append(f"{name}=42:00:00:00:{number:02x}:00@{x},{y}")
        self.answers = 0
        self.process = guest.start("", program, str(seed), *words)
        self._answer()

    def _answer(self) -> dict:
        """The next line that it writes."""
        lines = self.process.wait_for(
            lambda process: process.stdout.split("\n")[self.answers:-1], ANSWER_S, "an answer")
        self.answers += 1
        answer = json.loads(lines[0])
        if "error" in answer:
            raise GuestError(f"the medium: {answer['error']}")
        return answer

    def ask(self, line: str) -> dict:
        """A command of lab/wifi/medium/air.hpp. @raises GuestError when it is none"""
        self.process.write(line + "\n")
        return self._answer()

    def place(self, radio: str, x_m: float, y_m: float):
        self.ask(f"place {radio} {x_m} {y_m}")

    def power(self, radio: str, dbm: float):
        self.ask(f"power {radio} {dbm}")

    def lose(self, sender: str, receiver: str, share: float):
        """This share of the frames that one radio sends is lost on the way to the other."""
        self.ask(f"loss {sender} {receiver} {share}")

    def counters(self) -> dict:
        """All of it; "pairs" as a dictionary from (sender, receiver)."""
        answer = self.ask("counters")
        answer["pairs"] = {(pair["from"], pair["to"]): pair for pair in answer["pairs"]}
        return answer

    def close(self):
        self.process.close_input()
        self.process.wait(20)
        self.process.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
