"""Opens reports in Chromium as people do, and says what it met, as JSON on standard output.

    browser.py CHROMIUM PAGE WIDTH SCREENSHOT EXPRESSION...

Speaks the DevTools protocol through a pipe (file descriptors 3 and 4), so that Python alone is needed. Each EXPRESSION is
evaluated in the page, promises awaited; `@click X Y` presses the mouse at that point of the window, `@key NAME` a key;
`@print` prints the page and gives the number of images on paper.
Of `@click` the numbers may come from the expression before: `@click result` takes the pair that it gave.
"""

import base64
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time


class Browser:
    def __init__(self, program, profile):
        to_browser, self.out = os.pipe()
        self.into, from_browser = os.pipe()
        # The browser reads from 3 and writes to 4.
        def places():
            a, b = os.dup(to_browser), os.dup(from_browser)
            os.dup2(a, 3)
            os.dup2(b, 4)
            os.set_inheritable(3, True)
            os.set_inheritable(4, True)
        options = ["--headless=new", "--no-sandbox", "--remote-debugging-pipe", f"--user-data-dir={profile}",
                   "--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--disable-dev-shm-usage", "about:blank"]
        self.process = subprocess.Popen([program, *options], preexec_fn=places, close_fds=False,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.buffer, self.number, self.events = b"", 0, []

    def message(self):
        while b"\0" not in self.buffer:
            part = os.read(self.into, 1 << 20)
            if not part:
                raise SystemExit("the browser has ended")
            self.buffer += part
        text, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(text)

    def call(self, method, session=None, **params):
        self.number += 1
        own = self.number
        request = {"id": own, "method": method, "params": params}
        if session:
            request["sessionId"] = session
        os.write(self.out, json.dumps(request).encode() + b"\0")
        while True:
            message = self.message()
            if message.get("id") == own:
                if "error" in message:
                    raise SystemExit(f"{method}: {message['error']}")
                return message["result"]
            self.events.append(message)


def complaints(events):
    """Errors and warnings of the console, exceptions, and requests that left the file."""
    found = []
    for event in events:
        params = event.get("params", {})
        match event.get("method"):
            case "Runtime.exceptionThrown":
                details = params["exceptionDetails"]
                found.append(details.get("exception", {}).get("description", details["text"]))
            case "Runtime.consoleAPICalled" if params["type"] in ("error", "assert"):
                found.append(" ".join(str(argument.get("value", "")) for argument in params["args"]))
            case "Log.entryAdded" if params["entry"]["level"] == "error":
                found.append(params["entry"]["text"])
            case "Network.requestWillBeSent" if not params["request"]["url"].startswith(("file:", "data:", "blob:", "about:")):
                found.append("request to " + params["request"]["url"])
    return found


def main():
    program, page, width, screenshot, *steps = sys.argv[1:]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(program, profile)
        try:
            target = browser.call("Target.createTarget", url="about:blank")["targetId"]
            session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            call = lambda method, **params: browser.call(method, session, **params)
            for domain in ("Runtime", "Log", "Network", "Page"):
                call(f"{domain}.enable")
            narrow = int(width) < 600
            call("Emulation.setDeviceMetricsOverride", width=int(width), height=900, deviceScaleFactor=1, mobile=narrow)
            if "--dark" in steps:
                steps.remove("--dark")
                call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
            began = time.monotonic()
            call("Page.navigate", url=pathlib.Path(page).resolve().as_uri())
            while call("Runtime.evaluate", expression="document.readyState")["result"]["value"] != "complete":
                time.sleep(0.05)
            opened = time.monotonic() - began
            results = []
            for step in steps:
                results.append(act(call, step, results))
            if screenshot != "-":
                size = call("Page.getLayoutMetrics")["cssContentSize"]
                clip = {"x": 0, "y": 0, "width": int(width), "height": min(size["height"], 12000), "scale": 1}
                shot = call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)
                pathlib.Path(screenshot).write_bytes(base64.b64decode(shot["data"]))
            print(json.dumps({"results": results, "complaints": complaints(browser.events), "opened_s": opened}))
        finally:
            browser.process.kill()
            browser.process.wait()


def act(call, step, results):
    match step.split():
        case ["@click", *place]:
            x, y = results[-1] if place == ["result"] else map(float, place)
            for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
                button = "none" if kind == "mouseMoved" else "left"
                call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, clickCount=1)
            return None
        case ["@print"]:
            return base64.b64decode(call("Page.printToPDF", printBackground=True)["data"]).count(b"/Subtype /Image")
        case ["@key", name]:
            for kind in ("rawKeyDown", "keyUp"):
                call("Input.dispatchKeyEvent", type=kind, key=name)
            return None
    answer = call("Runtime.evaluate", expression=step, awaitPromise=True, returnByValue=True)
    if "exceptionDetails" in answer:
        raise SystemExit(f"{step}: {answer['exceptionDetails']}")
    return answer["result"].get("value")


main()
