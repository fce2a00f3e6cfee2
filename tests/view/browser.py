"""A headless Chromium, driven over its debugging port: open a page, ask it, take a picture."""
import base64
import json
import os
import shutil
import subprocess
import tempfile
import time

from websocket import WebSocket, get

START_S = 60


def find():
    """Path of a Chromium, or None."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        path = shutil.which(name)
        if path:
            return path
    return None


class Browser:
    """One page in a browser of its own. Ends with the `with`."""

    def __init__(self, address, width=1280, height=800, is_dark=False):
        self.folder = tempfile.mkdtemp(prefix="swarmtalk-browser")
        # A browser that runs as root has to do without its sandbox.
        self.process = subprocess.Popen(
            [find(), "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
             "--no-first-run", "--disable-background-networking", "--disable-dev-shm-usage",
             f"--window-size={width},{height}", "--remote-debugging-port=0",
             f"--user-data-dir={self.folder}", "about:blank"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            self.socket = self._connect()
            self.count = 0
            self.resize(width, height)
            if is_dark:
                self.call("Emulation.setEmulatedMedia",
                          features=[{"name": "prefers-color-scheme", "value": "dark"}])
            self.call("Page.enable")
            self.call("Page.navigate", url=address)
        except BaseException:
            self.close()
            raise

    def _connect(self):
        path = os.path.join(self.folder, "DevToolsActivePort")
        deadline = time.monotonic() + START_S
        while True:
            assert self.process.poll() is None, "the browser has ended"
            assert time.monotonic() < deadline, "the browser does not start"
            try:
                with open(path, encoding="utf-8") as file:
                    port = int(file.readline())
                pages = [page for page in json.loads(get(port, "/json")[2])
                         if page["type"] == "page"]
                if pages:
                    target = pages[0]["webSocketDebuggerUrl"].split(f":{port}")[1]
                    return WebSocket(port, target, timeout=60)
            except (OSError, ValueError, IndexError):
                pass
            time.sleep(0.05)

    def call(self, method, **parameters):
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self.socket.receive())
            if answer.get("id") == self.count:
                assert "error" not in answer, answer
                return answer["result"]

    def resize(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=False)

    def go(self, address):
        """Another page, whole, in place of this one."""
        self.ask("window.isLeft = true")
        self.call("Page.navigate", url=address)
        self.wait_for("!window.isLeft && document.readyState === 'complete'")

    def ask(self, expression):
        """The value of an expression in the page; a promise is waited for."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True,
                           awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait_for(self, expression, timeout=60.0):
        """Polls until the expression is true; returns its value."""
        deadline = time.monotonic() + timeout
        while True:
            value = self.ask(expression)
            if value:
                return value
            assert time.monotonic() < deadline, f"timed out waiting for {expression}"
            time.sleep(0.05)

    def picture(self, path):
        shot = self.call("Page.captureScreenshot", format="png")
        with open(path, "wb") as file:
            file.write(base64.b64decode(shot["data"]))

    def close(self):
        self.process.kill()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()
