"""The commands that ask a daemon, as a user runs them, and servers that are no impactd.

Not the daemon itself: that is daemon.py."""

import contextlib
import http.server
import os
import threading

import program


def client(url, *arguments, text="", environment=None, timeout=60):
    kept = {name: value for name, value in os.environ.items() if not name.startswith("IMPACTD_")}
    return program.run(*arguments, text=text, timeout=timeout,
                       environment={**kept, "IMPACTD_SERVER": url, **(environment or {})})


class Fake(http.server.BaseHTTPRequestHandler):
    """Answers as a list of functions says, one after another; the last one stays."""
    protocol_version = "HTTP/1.1"

    def answer(self):
        size = int(self.headers.get("Content-Length") or 0)
        self.rfile.read(size)
        self.server.seen.append((self.command, self.path, dict(self.headers)))
        plan = self.server.plan
        with contextlib.suppress(OSError):
            (plan.pop(0) if len(plan) > 1 else plan[0])(self)

    do_GET = do_POST = do_DELETE = answer

    def log_message(self, *_):
        pass


def say(code=200, body=b"{}", kind="application/json", length=None, **headers):
    def speak(handler):
        handler.send_response(code)
        handler.send_header("Content-Type", kind)
        handler.send_header("Content-Length", str(len(body) if length is None else length))
        for name, value in headers.items():
            handler.send_header(name.replace("_", "-"), value)
        handler.end_headers()
        handler.wfile.write(body)
        if length is not None:
            handler.close_connection = True
    return speak


def raw(data):
    def speak(handler):
        handler.wfile.write(data)
        handler.close_connection = True
    return speak


@contextlib.contextmanager
def fake(*plan):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Fake)
    server.plan, server.seen = list(plan), []
    server.daemon_threads = True
    server.handle_error = lambda *_: None
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}", server.seen
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def endless_headers(handler):
    handler.wfile.write(b"HTTP/1.1 200 OK\r\n")
    for i in range(100000):
        handler.wfile.write(b"X-%d: %s\r\n" % (i, b"y" * 900))


def endless_body(handler):
    handler.wfile.write(b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n")
    piece = b"%x\r\n%s\r\n" % (1 << 20, b"[" * (1 << 20))
    for _ in range(200):
        handler.wfile.write(piece)
