"""Python client of impactd, a server that simulates impact dampers.

    import impactd

    lab = impactd.connect("http://127.0.0.1:8080")
    r = lab.run("paper_free_sponge", **{"dampers.0.clearance": 0.01})
    print(r.summary["impacts"], r.time[-1], max(r.displacement))

This file needs Python 3.9 or later and the standard library. NumPy, pandas and Matplotlib are used
where they are installed: without NumPy a channel is a list of floats, without pandas a table is a
list of dicts, and without Matplotlib `plot` raises an ImportError. All quantities are in SI units.
"""
from __future__ import annotations

import base64
import collections.abc
import copy
import csv
import difflib
import html
import http.client
import importlib
import io
import ipaddress
import json
import os
import queue
import random
import re
import ssl
import sys
import tempfile
import threading
import time
import urllib.parse
import uuid
import warnings
from array import array
from typing import Any, Callable, Iterable, Iterator, Mapping, NamedTuple, Optional, Sequence, Union

__version__ = "0.1.0"
__all__ = ["connect", "Lab", "Job", "Result", "Study", "Problem", "UnexpectedAnswer", "Fault", "Spectrum"]

Scene = Union[Mapping[str, Any], str, "os.PathLike[str]", "Result"]
Progress = Union[bool, Callable[[int, int], Any]]

# Keywords with these names, and all with a dot or a slash, change the scene; others set a study.
_SCENE_MEMBERS = ("structure", "dampers", "contact", "excitation", "duration", "sample_rate",
                  "accuracy", "output", "title", "labels")
_THREADS = 8        # requests at a time in submit and gather
_WAIT = 20          # [s] that one request waits for a job
_RETRIES = 4        # of a request whose connection failed
_PAGES = 10000      # of one list
_MOST = 1 << 30     # [bytes] of an answer that is kept in memory
_CHUNK = 1 << 16    # [bytes] that are read at a time
_PATIENCE = 20      # times the timeout in which a whole answer must be here


# --- errors ---

def _clean(text: Any) -> str:
    """A text of the server for a terminal: control characters are shown as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text))


class Fault(NamedTuple):
    """One fault of a request: where it is (a JSON Pointer), what is wrong and what would be right."""
    pointer: str
    detail: str
    value: Any = None
    unit: Optional[str] = None
    did_you_mean: Optional[str] = None

    def __str__(self) -> str:
        hint = f'; did you mean "{self.did_you_mean}"?' if self.did_you_mean else ""
        return _clean(f"{self.pointer}: {self.detail}{hint}")


class Problem(Exception):
    """A request that the server refused, or a job that failed. `print(problem)` shows all faults.

    status  HTTP status code; for a failed job that of its problem.
    type    what kind of problem, such as "/problems/invalid-scene"; the path leads to its documentation.
    title, detail   sentences.
    faults  all faults with their places, a list of Fault.
    job     the Job that failed or was refused, or None.

        try:
            lab.run({"structure": {"mass": -1}})
        except impactd.Problem as problem:
            for fault in problem.faults:
                print(fault.pointer, fault.detail)
    """

    def __init__(self, document: Mapping[str, Any], status: int = 0, job: Optional[Job] = None):
        self.document = dict(document)
        own, errors = document.get("status"), document.get("errors")
        self.status: int = own if isinstance(own, int) and own else status
        self.type = _text(document, "type") or "about:blank"
        self.title = _text(document, "title") or f"HTTP status {self.status}"
        self.detail = _text(document, "detail")
        self.faults = [Fault(_text(fault, "pointer") or _place(fault), _text(fault, "detail"), fault.get("value"),
                             fault.get("unit"), fault.get("did_you_mean"))
                       for fault in (errors if isinstance(errors, list) else []) if isinstance(fault, collections.abc.Mapping)]
        self.job = job
        super().__init__(self.title)

    def __str__(self) -> str:
        lines = [_clean(f"{self.title} ({self.type}, status {self.status})")]
        if self.detail and not any(self.detail.endswith(fault.detail) for fault in self.faults):
            lines.append(f"  {_clean(self.detail)}")
        return "\n".join(lines + [f"  {fault}" for fault in self.faults])

    def __reduce__(self) -> Any:  # for another process; a job has a connection and stays here
        return type(self), (self.document, self.status), {"title": self.title}


class UnexpectedAnswer(Exception):
    """An answer that impactd does not give: something else may answer at this address."""


def _text(document: Mapping[str, Any], name: str) -> str:
    """A member that is a string, else an empty one."""
    return document[name] if isinstance(document.get(name), str) else ""


def _place(fault: Mapping[str, Any]) -> str:
    """The place of a fault in a table, which has no JSON Pointer."""
    return ", ".join(f"{name} {fault[name]}" for name in ("row", "column") if fault.get(name) is not None)


def _fault(pointer: str, detail: str, value: Any = None, names: Iterable[str] = ()) -> Problem:
    near = difflib.get_close_matches(str(value), list(names), 1)
    return Problem({"type": "/problems/invalid-scene", "title": "The scene has 1 fault", "status": 422,
                    "errors": [{"pointer": pointer, "detail": detail, "value": value,
                                "did_you_mean": near[0] if near else None}]})


# --- values, paths and tables ---

def _optional(name: str) -> Any:
    """A package that may be missing: the module or None."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def _required(name: str, what: str) -> Any:
    module = _optional(name)
    if module is None:
        package = name.split(".")[0]
        raise ImportError(f"{what} needs {package}, which is not installed: python3 -m pip install {package}")
    return module


def _plain(value: Any) -> Any:
    """JSON of NumPy's arrays and numbers, of pandas' columns and of paths."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (collections.abc.Mapping, collections.abc.Iterable)):
        return dict(value) if isinstance(value, collections.abc.Mapping) else list(value)
    raise TypeError(f"a {type(value).__name__} cannot be written as JSON")


def _encode(document: Any) -> bytes:
    try:
        return json.dumps(document, default=_plain, allow_nan=False).encode()
    except RecursionError:
        raise ValueError("the document is nested too deeply, or contains itself") from None
    except ValueError as error:
        if "Circular" in str(error):
            raise ValueError("the document contains itself") from None
        raise ValueError("NaN and infinity cannot be sent; None is an absent value") from error


def _steps(path: str) -> list[str]:
    """The names in "dampers.0.clearance" or "/dampers/0/clearance"."""
    if path.startswith("/"):
        return [step.replace("~1", "/").replace("~0", "~") for step in path[1:].split("/")]
    return path.split(".")


def _pointer(path: str) -> str:
    return "/" + "/".join(step.replace("~", "~0").replace("/", "~1") for step in _steps(path))


def _dotted(pointer: str) -> str:
    """A column's name: a JSON Pointer is written as overrides are, "dampers.0.clearance"."""
    return ".".join(_steps(pointer)) if pointer.startswith("/") else pointer


def _set(scene: Any, path: str, value: Any) -> None:
    """Changes one member of a scene. Objects that are absent are added; a list must have the item."""
    steps, at, place = _steps(path), scene, ""
    for i, step in enumerate(steps):
        place += "/" + step
        is_last = i + 1 == len(steps)
        if isinstance(at, list):
            if not re.fullmatch("[0-9]{1,18}", step) or int(step) >= len(at):
                raise _fault(place, f"the list has {len(at)} items, numbered from 0; there is no item {step!r}", step)
            key: Any = int(step)
        elif isinstance(at, dict):
            if i == 0 and step not in _SCENE_MEMBERS and step not in at:
                raise _fault(place, "a scene has no such member", step, _SCENE_MEMBERS)
            key = step
        else:
            raise _fault(place, f"the value there is {at!r}, which has no members: set {_dotted(place.rsplit('/', 1)[0])!r}")
        if is_last:
            at[key] = value
        else:
            at = at.setdefault(key, {}) if isinstance(at, dict) else at[key]


def _cell(text: str) -> Any:
    if re.fullmatch("-?[0-9]{1,18}", text):
        return int(text)
    if re.fullmatch(r"-?([0-9]+\.?[0-9]*|\.[0-9]+)(e[-+]?[0-9]+)?|nan|-?inf", text):
        return float(text)
    return {"true": True, "false": False}.get(text, text)


def _read_csv(text: str) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """The rows of a table and the units of its columns; the header says "name [unit]"."""
    lines = csv.reader(io.StringIO(text, newline=""))
    names, units = [], {}
    for title in next(lines, []):
        name, _, unit = title.partition(" [")
        names.append(_dotted(name))
        if unit:
            units[names[-1]] = unit.rstrip("]")
    return [dict(zip(names, map(_cell, line))) for line in lines], units


def _table(rows: list[dict[str, Any]], units: Optional[Mapping[str, str]] = None) -> Any:
    """A DataFrame, or the rows as they are without pandas."""
    pandas = _optional("pandas")
    if pandas is None:
        return rows
    frame = pandas.DataFrame(rows)
    frame.attrs["units"] = dict(units or {})
    return frame


def _column(values: Any) -> Any:
    """One channel: an array of NumPy, or a list."""
    numpy = _optional("numpy")
    return numpy.asarray(values, dtype=float) if numpy else list(values)


def _read_npy(data: bytes) -> list[Any]:
    """The columns of an NPY file of float64 in Fortran order, which is what the server writes."""
    size = int.from_bytes(data[8:10], "little")
    found = re.search(rb"'shape': \((\d+), (\d+)\)", data[10:10 + size])
    count, start, columns = int(found[1]) if found else 0, 10 + size, []
    if found is None or len(data) != start + 8 * count * int(found[2]):
        raise UnexpectedAnswer("the answer is not a whole table of numbers in NumPy's format")
    numpy = _optional("numpy")
    for c in range(int(found[2])):
        part = memoryview(data)[start + 8 * count * c:start + 8 * count * (c + 1)]
        if numpy:
            columns.append(numpy.frombuffer(part, "<f8").astype(float))  # a copy, which may be changed
        else:
            numbers = array("d", bytes(part))
            if sys.byteorder == "big":
                numbers.byteswap()
            columns.append(numbers.tolist())
    return columns


def _axis(path: Union[str, Sequence[str]], values: Any) -> dict[str, Any]:
    """An axis of a study: (from, to) or (from, to, count) as a tuple, an axis' members as a dict, else values."""
    paths = [path] if isinstance(path, str) else list(path)
    axis: dict[str, Any] = {"pointer": _pointer(paths[0])} if len(paths) == 1 else {"pointers": list(map(_pointer, paths))}
    if isinstance(values, collections.abc.Mapping):
        axis.update(values)
    elif isinstance(values, tuple) and len(values) in (2, 3):
        axis.update(zip(("from", "to", "count"), values))
    elif isinstance(values, (str, int, float)):
        raise TypeError(f"the values of {path!r} are a list, an array or a tuple (from, to, count), not {values!r}")
    else:
        axis["values"] = list(values) if not hasattr(values, "tolist") else values.tolist()
    return axis


def _axes(axes: Any) -> Optional[list[Any]]:
    if isinstance(axes, collections.abc.Mapping):
        return [_axis(path, values) for path, values in axes.items()]
    return None if axes is None else list(axes)


# --- the connection ---

class _Reply(NamedTuple):
    status: int
    headers: Any
    body: bytes

    def json(self, path: str = "", has: Sequence[str] = ()) -> Any:
        """The document, an object with these members where some are named."""
        try:
            document = json.loads(self.body)
        except (ValueError, RecursionError):
            text = _clean(self.body[:60].decode("utf-8", "replace"))
            raise UnexpectedAnswer(f"the answer of {path} is not JSON: {text!r}") from None
        absent = [name for name in has if not isinstance(document, dict) or name not in document]
        if absent:
            raise UnexpectedAnswer(f"the answer of {path} has no member {absent[0]!r}")
        return document


def _address(url: str) -> tuple[urllib.parse.SplitResult, Optional[int]]:
    """The parts of a server's address and its port. No message shows an address that may have a password in it."""
    if any(secret in url for secret in "@?#"):
        raise ValueError("the address of a server has no user, password, query or fragment: https://sim.example.org/path; "
                         "a token is an argument of its own")
    try:
        parts = urllib.parse.urlsplit(url if "//" in url else "http://" + url)
        port = parts.port
    except ValueError:
        parts, port = None, None
    if parts is None or parts.scheme not in ("http", "https") or not parts.hostname or not re.fullmatch(r"[^\s\x00-\x1f\x7f]+", url):
        raise ValueError(f"{url!r} is not the address of a server, such as http://127.0.0.1:8080")
    return parts, port


def _token(token: Optional[str]) -> Optional[str]:
    """The token without blanks and line ends at its ends. No message shows it."""
    token = token.strip() if isinstance(token, str) else token
    if not token:
        return None
    if not isinstance(token, str) or not re.fullmatch(r"[A-Za-z0-9._~+/=-]{1,512}", token):
        raise ValueError("the token must be a string of 1 to 512 letters, digits and -._~+/=")
    return token


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class _Http:
    """Requests to one server. Connections are reused; a thread has one of its own during a request."""

    def __init__(self, url: str, token: Optional[str], ca_file: Optional[str], timeout: float, patience: float):
        parts, self.port = _address(url)
        self.url = f"{parts.scheme}://{parts.netloc}{parts.path.rstrip('/')}"
        self.host, self.base = parts.hostname or "", parts.path.rstrip("/")
        self.ca_file = ca_file
        self.tls = ssl.create_default_context(cafile=ca_file) if parts.scheme == "https" else None
        self.token, self.timeout, self.patience = _token(token), timeout, patience
        if self.token and self.tls is None and not _is_loopback(self.host):
            warnings.warn(f"the token is sent to {self.host} without encryption; use https", stacklevel=4)
        self.idle: list[http.client.HTTPConnection] = []
        self.lock = threading.Lock()
        self.is_known = False  # whether it has answered before: then it may be starting again

    def __reduce__(self) -> Any:
        """For pickle, without connections. The token stays out of files: IMPACTD_TOKEN is used then."""
        return _reopened, (self.url, self.ca_file, self.timeout, self.patience)

    def close(self) -> None:
        with self.lock:
            idle, self.idle = self.idle, []
        for connection in idle:
            connection.close()

    def open(self) -> http.client.HTTPConnection:
        if self.tls is not None:
            return http.client.HTTPSConnection(self.host, self.port, timeout=self.timeout, context=self.tls)
        return http.client.HTTPConnection(self.host, self.port, timeout=self.timeout)

    def path(self, link: str) -> str:
        """A link of an answer, or a path of the API, as this server is reached. Never another host."""
        parts = urllib.parse.urlsplit(link)
        path = parts.path if parts.path.startswith(self.base + "/") else self.base + parts.path
        if re.search(r"[^!-~]", path + parts.query):
            raise ValueError(f"{_clean(path)!r} has blanks or characters that a path cannot have")
        return path + ("?" + parts.query if parts.query else "")

    def read(self, answer: http.client.HTTPResponse, file: Any) -> bytes:
        """The whole body, in time and within its bound; written to `file` where one is given."""
        end, size, parts = time.monotonic() + _PATIENCE * self.timeout, 0, []
        left = answer.length  # None where the server did not name it
        while left != 0:
            part = answer.read1(_CHUNK if left is None else min(left, _CHUNK))  # read would wait for a full chunk
            if not part and left is not None:  # http.client does not raise it for parts
                raise http.client.IncompleteRead(b"", left)
            if not part:
                break
            size += len(part)
            left = None if left is None else left - len(part)
            if file is not None:
                file.write(part)
            elif size > _MOST:
                raise UnexpectedAnswer(f"an answer is larger than {_MOST} bytes: save it to a file, or ask for a part")
            else:
                parts.append(part)
            if file is None and time.monotonic() > end:
                raise TimeoutError(f"an answer of {self.url} is not complete after {_PATIENCE * self.timeout:g} s")
        answer.close()  # the connection stays
        return b"".join(parts)

    def send(self, method: str, path: str, body: Optional[bytes], headers: Mapping[str, str], is_safe: bool,
             file: Any = None) -> _Reply:
        """One exchange. A connection that the server closed meanwhile is replaced if the request may be repeated."""
        with self.lock:
            connection = self.idle.pop() if self.idle and is_safe else None
        is_reused = connection is not None
        connection = connection or self.open()
        try:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            reply = _Reply(answer.status, answer.headers, self.read(answer, file if answer.status == 200 else None))
        except BaseException as error:
            connection.close()
            if is_reused and isinstance(error, (ConnectionError, http.client.BadStatusLine)):
                return self.send(method, path, body, headers, is_safe, file)
            raise
        if answer.will_close:
            connection.close()
        else:
            with self.lock:
                self.idle.append(connection)
        return reply

    def request(self, method: str, link: str, body: Optional[bytes] = None,
                headers: Optional[Mapping[str, str]] = None, file: Any = None) -> _Reply:
        """The answer below 400, else raises Problem. Repeats what may be repeated: after 429 and 503 at the time that
        the server names, after a failed connection GET, DELETE and POST with an Idempotency-Key. The body is written to
        `file` where one is given."""
        all_headers = {"Accept": "*/*", "User-Agent": f"impactd-python/{__version__}", **(headers or {})}
        if self.token:
            all_headers["Authorization"] = f"Bearer {self.token}"
        is_safe = method in ("GET", "DELETE") or "Idempotency-Key" in all_headers
        path, end, failures, hops = self.path(link), time.monotonic() + self.patience, 0, 0
        while True:
            try:
                if file is not None:
                    file.seek(0)
                    file.truncate()
                reply = self.send(method, path, body, all_headers, is_safe, file)
            except ssl.SSLCertVerificationError as error:
                raise ConnectionError(f"the certificate of {self.url} is not trusted: {error.verify_message}; "
                                      "name the file of its authority as ca_file") from error
            except (OSError, http.client.HTTPException) as error:
                failures += 1
                if not is_safe or failures > (_RETRIES if self.is_known else 0):
                    raise ConnectionError(f"no answer from {self.url}: {error or type(error).__name__}; "
                                          "is the server running (impactd serve)?") from error
                time.sleep(min(0.1 * 4 ** failures, 5) * random.uniform(0.5, 1))
                continue
            self.is_known = True
            if reply.status in (301, 307, 308) and method == "GET" and hops < 3:
                hops, path = hops + 1, self.path(reply.headers.get("Location", ""))
                continue
            if reply.status < 400:
                return reply
            delay = reply.headers.get("Retry-After")
            delay = float(delay) if delay and re.fullmatch("[0-9]{1,9}", delay) else None
            if reply.status in (429, 503) and delay is not None and time.monotonic() + delay < end:
                time.sleep(max(delay, 0.05) * random.uniform(1, 1.2))
                continue
            raise Problem(*self.problem(reply))

    @staticmethod
    def problem(reply: _Reply) -> tuple[dict[str, Any], int]:
        try:
            document = reply.json()
        except UnexpectedAnswer:
            document = None
        if not isinstance(document, dict):
            document = {"detail": reply.body[:500].decode("utf-8", "replace").strip()}
        return document, reply.status

    def json(self, method: str, link: str, document: Any = None, headers: Optional[Mapping[str, str]] = None,
             has: Sequence[str] = ()) -> Any:
        body, all_headers = None, dict(headers or {})
        if document is not None:
            body = _encode(document)
            all_headers["Content-Type"] = "application/json"
        reply = self.request(method, link, body, all_headers)
        return reply.json(link, has) if reply.body or has else None

    def pages(self, link: str, name: str, limit: Optional[int] = None) -> list[dict[str, Any]]:
        """The items of all pages of a list."""
        items: list[dict[str, Any]] = []
        seen: set[str] = set()
        while link and (limit is None or len(items) < limit):
            if link in seen or len(seen) == _PAGES:
                raise UnexpectedAnswer(f"the list has more than {_PAGES} pages, or its page {_clean(link)!r} leads back to itself")
            seen.add(link)
            reply = self.request("GET", link)
            page = reply.json(link, (name,))[name]
            if not isinstance(page, list) or not all(isinstance(one, dict) for one in page):
                raise UnexpectedAnswer(f"the answer of {_clean(link)} has no list {name!r} of objects")
            items += page
            found = re.search(r'<([^>]*)>\s*;\s*rel="?next', reply.headers.get("Link") or "")
            link = found[1] if found else ""
        return items if limit is None else items[:limit]


def _query(path: str, **values: Any) -> str:
    """A path with those of the values that are not None."""
    given = {name: value for name, value in values.items() if value is not None}
    return path + ("?" + urllib.parse.urlencode(given) if given else "")


def _name(text: str) -> str:
    if text == "":
        raise ValueError("an id or a name is empty")
    return urllib.parse.quote(str(text), safe="@")


class _Progress:
    """A line on standard error, or a call of the user's function with (done, total)."""

    def __init__(self, wanted: Progress, total: int, what: str):
        self.call = wanted if callable(wanted) else None
        self.is_shown = wanted is True
        self.total, self.what, self.begin, self.shown = total, what, time.monotonic(), 0.0

    def __call__(self, done: int) -> None:
        if self.call:
            self.call(done, self.total)
        if not self.is_shown:
            return
        now = time.monotonic()
        if done < self.total and now - self.shown < 0.1:
            return
        self.shown = now
        count = f"{done} %" if self.what == "%" else f"{done} of {self.total} {self.what}"
        sys.stderr.write(f"\r{count}, {now - self.begin:.1f} s" + ("\n" if done >= self.total else ""))
        sys.stderr.flush()


def _parallel(work: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[tuple[int, Any]]:
    """(index, work(item)) of each item as it is done, by a few threads; an exception is a value, too."""
    todo, done = queue.SimpleQueue(), queue.SimpleQueue()
    is_over = threading.Event()
    for pair in enumerate(items):
        todo.put(pair)

    def loop() -> None:
        while not is_over.is_set():
            try:
                index, item = todo.get_nowait()
            except queue.Empty:
                return
            try:
                done.put((index, work(item)))
            except Exception as error:  # handed to the caller
                done.put((index, error))

    for _ in range(min(_THREADS, len(items))):
        threading.Thread(target=loop, daemon=True).start()
    try:
        for _ in items:
            yield done.get()
    finally:
        is_over.set()


# --- jobs and results ---

_JOB = ("id", "status", "progress", "result")  # members that are used of a job, and of a result
_RESULT = ("id", "scene", "summary", "plan", "warnings", "units", "channels")


class Job:
    """A submitted scene. `job.result()` waits for its result; `job.id` is its id on the server.

    status    "accepted", "running", "successful", "failed" or "dismissed", when last asked
    progress  per cent done, when last asked
    """

    def __init__(self, lab: Lab, document: Mapping[str, Any]):
        self._lab = lab
        self.document = dict(document)
        self.id: str = document["id"]

    @property
    def status(self) -> str:
        return self.document["status"]

    @property
    def progress(self) -> float:
        done = self.document["progress"]
        if not isinstance(done, (int, float)):
            raise UnexpectedAnswer(f"the progress of job {self.id} is no number: {_clean(done)[:60]!r}")
        return done

    @property
    def is_finished(self) -> bool:
        return self.status not in ("accepted", "running")

    def refresh(self, wait: float = 0) -> Job:
        """Asks for the state; with `wait` the answer comes when the job is finished, or after so many seconds."""
        path = f"/v1/jobs/{_name(self.id)}" + (f"?wait={wait:g}" if wait else "")
        self.document = self._lab._http.json("GET", path, has=_JOB)
        return self

    def wait(self, timeout: Optional[float] = None) -> Job:
        """Waits until the job is finished; TimeoutError after `timeout` seconds, while the job continues."""
        return self._wait(timeout, None if timeout is None else time.monotonic() + timeout)

    def _wait(self, timeout: Optional[float], end: Optional[float]) -> Job:
        while not self.is_finished:
            left = _WAIT if end is None else min(_WAIT, end - time.monotonic())
            if left <= 0:
                raise TimeoutError(f"job {self.id} is {self.status} ({self.progress:g} %) after {timeout:g} s and continues")
            self.refresh(min(left, max(self._lab._http.timeout / 2, 0.1)))
        return self

    def result(self, timeout: Optional[float] = None) -> Result:
        """Waits, and returns the Result, of a study the Study. Raises Problem where the job failed or was cancelled."""
        self.wait(timeout)
        if self.status != "successful":
            kind = "cancelled" if self.status == "dismissed" else "internal-error"
            plain = {"title": f"Job {self.id} is {self.status}", "type": f"/problems/{kind}", "status": 409}
            document = self.document.get("problem")
            raise Problem(document if isinstance(document, dict) and document else plain, job=self)
        if not isinstance(self.document["result"], str):
            raise UnexpectedAnswer(f"job {self.id} is successful and has no result")
        return (Study if self.document.get("study") else Result)(self._lab, self.document["result"], self.document)

    def cancel(self) -> Job:
        """Stops the job; one that is finished stays as it is."""
        try:
            self.document = self._lab._http.json("DELETE", f"/v1/jobs/{_name(self.id)}", has=_JOB)
        except Problem as problem:
            if problem.status != 409:
                raise
            self.refresh()
        return self

    def __repr__(self) -> str:
        return _clean(f"<impactd.Job {self.id} {self.status}>")


class Spectrum(NamedTuple):
    """A one-sided power spectral density: `frequency, density = r.psd()`. [Hz], [unit of the channel squared per Hz]"""
    frequency: Any
    density: Any


class Result:
    """A finished run. Channels are attributes and items: `r.displacement`, `r["contact_force_1"]`.

        r = lab.run("paper_free_sponge")
        r.time, r.displacement        # [s], [m]; r.units has the unit of every channel
        r.summary["rms_displacement"]
        r.impacts                     # one row per impact
        frequency, density = r.psd()
        r.save("motion.csv")

    Series are fetched when they are first used, and are kept.
    """

    def __init__(self, lab: Lab, id: str, job: Optional[Mapping[str, Any]] = None):
        self._lab = lab
        self.id = id
        self._job = job
        self._kept: dict[str, Any] = {}

    def _get(self, key: str, make: Callable[[], Any]) -> Any:
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def _part(self, name: str) -> str:
        return f"/v1/results/{_name(self.id)}/{name}"

    @property
    def document(self) -> dict[str, Any]:
        """The whole document of the result, as GET /v1/results/{id} answers it."""
        return self._get("document", lambda: self._lab._http.json(
            "GET", f"/v1/results/{_name(self.id)}", has=_RESULT))

    def _of_job(self, name: str) -> Any:
        return self._job[name] if self._job and self._job.get(name) is not None else self.document[name]

    @property
    def summary(self) -> dict[str, Any]:
        """Peaks, rms values, number of impacts, error estimate, and what the dampers gain. Units: `r.units`."""
        return self._of_job("summary")

    @property
    def plan(self) -> dict[str, Any]:
        """The contact model and the solver with the reason of each choice; "derived" has stiffness and damping of each stop."""
        return self._of_job("plan")

    @property
    def warnings(self) -> list[dict[str, str]]:
        """What to know about this result, each with a JSON Pointer into the scene and a sentence."""
        return self._of_job("warnings")

    @property
    def scene(self) -> dict[str, Any]:
        """The scene with all defaults filled in; `lab.run(r.scene)` gives the same result."""
        return self.document["scene"]

    @property
    def units(self) -> dict[str, str]:
        """The unit of every quantity of the summary and of every channel."""
        return self.document["units"]

    @property
    def channels(self) -> list[str]:
        """Names of the channels that the scene asked for (output.channels)."""
        return self.document["channels"]

    @property
    def cached(self) -> bool:
        """Whether the server had this result already and computed nothing."""
        return bool(self._job and self._job["cached"])

    @property
    def time(self) -> Any:
        """Times of the samples [s]; sample i is at i / sample_rate."""
        return self._series()["time"]

    def _series(self) -> dict[str, Any]:
        return self._get("series", lambda: dict(zip(
            ["time", *self.channels], _read_npy(self._lab._http.request("GET", self._part("series.npy")).body))))

    def __getitem__(self, channel: str) -> Any:
        if channel == "time" or channel in self.channels:
            return self._series()[channel]
        raise KeyError(self._no_channel(channel))

    def _no_channel(self, name: str) -> str:
        near = difflib.get_close_matches(name, self.channels, 1)
        return (f"there is no channel {name!r} in this result" + (f"; did you mean {near[0]!r}?" if near else "")
                + f". It has {', '.join(self.channels) or 'none'}; ask for others by output.channels of the scene")

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name in self.channels:
            return self._series()[name]
        raise AttributeError(self._no_channel(name))

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.channels]

    def series(self, *channels: str, start: Optional[float] = None, end: Optional[float] = None,
               points: Optional[int] = None) -> Any:
        """A table of the time series: a DataFrame or a list of dicts, with the column "time" [s].

        Only some channels, only from `start` to `end` [s], or with `points` the least and the largest value in so
        many intervals of time, columns "NAME_min" and "NAME_max", so that no peak is lost.

            r.series("displacement", start=0, end=2)
        """
        text = self._lab._http.request("GET", _query(
            self._part("series.csv"), channels=",".join(channels) or None, **{"from": start}, to=end, points=points)).body
        return _table(*_read_csv(text.decode()))

    @property
    def frame(self) -> Any:
        """All channels as a pandas DataFrame with the column "time"; `frame.attrs["units"]` has the units."""
        pandas = _required("pandas", "frame")
        frame = pandas.DataFrame(self._series())
        frame.attrs["units"] = {"time": "s", **{name: self.units[name] for name in self.channels}}
        return frame

    @property
    def impacts(self) -> Any:
        """The list of impacts: a DataFrame, or a list of dicts. start, end, duration [s], speeds [m/s], peak_force [N],
        impulse [N s], energy_lost [J]; "kind" is "impact", or "resting" for an interval of lasting contact."""
        return self._get("impacts", lambda: _table(self._lab._http.json(
            "GET", self._part("impacts.json"), has=("impacts",))["impacts"]))

    def impact(self, number: int, points: Optional[int] = None) -> Any:
        """One impact in detail, numbered from 1: a table of the contact force over time."""
        text = self._lab._http.request("GET", _query(self._part(f"impacts/{number}/force.csv"), points=points)).body
        return _table(*_read_csv(text.decode()))

    def psd(self, channel: Optional[str] = None) -> Spectrum:
        """The power spectral density of a channel of output.psd, by default the first: (frequency [Hz], density).

            frequency, density = r.psd("mean_acceleration")     # [Hz], [(m/s^2)^2/Hz]
        """
        document = self._get("psd", lambda: self._lab._http.json(
            "GET", self._part("psd.json"), has=("frequency", "channels")))
        channels = document["channels"]
        channel = channel or next(iter(channels))
        if channel not in channels:
            raise KeyError(f"the scene asked for spectra of {', '.join(channels)}, not of {channel!r} (output.psd.channels)")
        return Spectrum(_column(document["frequency"]["values"]), _column(channels[channel]["values"]))

    @property
    def energy(self) -> dict[str, Any]:
        """The energy balance [J]: initial, input, structural_damping, contact, kinetic, strain, residual."""
        return self._get("energy", lambda: self._lab._http.json("GET", self._part("energy.json")))

    def compare(self, other: Union[Result, str]) -> dict[str, Any]:
        """This result and another one with metrics, inputs that differ, distance of spectra, time of divergence."""
        return self._lab._http.json("GET", _query("/v1/compare", a=self.id, b=getattr(other, "id", other)))

    # What save writes, by extension, and the chart of plots in a notebook.
    _table_part, _svg_part = "series", "series.svg"

    def save(self, path: Union[str, os.PathLike[str]], part: Optional[str] = None) -> None:
        """Writes a file, whole or not at all. The extension gives the format:

        .csv .npy .npz .mat   the time series, of a study its table; part="psd", "impacts" or "energy" another part.
        .svg                  a chart of them.
        .json                 the job, the series, the impacts and the spectra in one document; of a study its answer.
        .zip                  everything, with a note on units and how to cite.
        """
        path = os.fspath(path)
        extension = os.path.splitext(path)[1][1:].lower()
        name = "bundle.zip" if extension == "zip" else f"{_name(part or self._table_part)}.{_name(extension)}"
        whole = _encode(self._whole()) if extension == "json" and part is None else None
        folder = os.path.dirname(os.path.abspath(path))
        try:
            handle, draft = tempfile.mkstemp(prefix=".impactd-", dir=folder)
        except OSError as error:
            error.filename = path
            raise
        try:
            with open(handle, "wb") as file:
                if whole is None:
                    self._lab._http.request("GET", self._part(name), file=file)
                else:
                    file.write(whole)
            mask = os.umask(0)
            os.umask(mask)
            os.chmod(draft, 0o666 & ~mask)
            os.replace(draft, path)
        except BaseException:
            os.unlink(draft)
            raise

    def _whole(self) -> dict[str, Any]:
        def optional(name: str) -> Any:
            try:
                return self._lab._http.json("GET", self._part(name))
            except Problem as problem:  # the scene did not ask for it
                if problem.status != 404:
                    raise
                return None
        parts = {name: optional(name + ".json") for name in ("series", "impacts", "psd")}
        return {"job": self._job or self.document, **parts}

    def plot(self, *channels: str, figure: Any = None) -> Any:
        """A Matplotlib figure: each channel over time, and the spectrum below. Returns the figure.

            r.plot("displacement", "contact_force").savefig("motion.png")
        """
        pyplot = _required("matplotlib.pyplot", "plot")
        names = list(channels) or [name for name in self.channels if not re.match(r"velocity|damper_velocity", name)][:4]
        has_psd = not channels and bool(self.scene["output"].get("psd"))
        figure = figure or pyplot.figure(figsize=(8, 1 + 2 * (len(names) + has_psd)), layout="constrained")
        axes = figure.subplots(len(names) + has_psd, 1, squeeze=False)[:, 0]
        for axis, name in zip(axes, names):
            axis.plot(self.time, self[name], linewidth=0.8)
            axis.set_ylabel(f"{name.replace('_', ' ')} [{self.units[name]}]")
            axis.set_xlabel("time [s]")
            axis.sharex(axes[0])
        if has_psd:
            frequency, density = self.psd()
            axes[-1].semilogy(frequency[1:], density[1:], linewidth=0.8)
            axes[-1].set_xlabel("frequency [Hz]")
            axes[-1].set_ylabel("power spectral density")
        return figure

    def _title(self) -> str:
        return (self._job or {}).get("title") or self.id[:10]

    def _rows(self) -> list[tuple[str, str]]:
        """The lines of the small table in a notebook."""
        units = self.units
        return [(name.replace("_", " "), f"{value:.6g} {units.get(name, '')}".strip())
                for name, value in self.summary.items() if isinstance(value, (int, float))]

    def _repr_html_(self) -> str:
        """What a notebook shows: the summary, the warnings, and a chart drawn by the server."""
        rows = "".join(f"<tr><th style='text-align:left'>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
                       for name, value in self._rows())
        notes = "".join(f"<p>{html.escape(one['pointer'])}: {html.escape(one['detail'])}</p>" for one in self.warnings)
        page = f"<h4>{html.escape(self._title())}</h4><table>{rows}</table>{notes}"
        try:
            chart = base64.b64encode(self._lab._http.request("GET", self._part(self._svg_part)).body).decode()
        except Problem:  # a scene without channels has no chart
            return page
        # As an image: the style of a chart must not reach the page.
        return page + f"<img alt='chart' style='max-width:100%' src='data:image/svg+xml;base64,{chart}'>"

    def __repr__(self) -> str:
        return _clean(f"<impactd.{type(self).__name__} {self.id[:10]} {self._title()!r}>")


# The part of a result with a study's answer, where it is not the kind itself.
_PARTS = {"sweep": "table", "optimize": "optimum", "calibrate": "calibration"}


class Study(Result):
    """A finished study: many runs of one scene. It is also the Result of the scene as given.

        s = lab.sweep("paper_free_sponge", {"dampers.0.clearance": (0.005, 0.025, 21)})
        s.table                       # one row per run; s.frame is a DataFrame
        s.best("rms_displacement")    # the row with the smallest value
        s.answer                      # all that the server says of the study
    """

    @property
    def kind(self) -> str:
        """The kind of the study, such as "sweep"."""
        return self.document["study"]["kind"]

    @property
    def warnings(self) -> list[dict[str, str]]:
        """What to know about the study and about the run of the scene as given."""
        return [*self.answer.get("warnings", []), *super().warnings]

    @property
    def _table_part(self) -> str:  # type: ignore[override]
        return _PARTS.get(self.kind, self.kind)

    @property
    def _svg_part(self) -> str:  # type: ignore[override]
        return self._table_part + ".svg"

    @property
    def answer(self) -> dict[str, Any]:
        """The study's whole answer: statistics, best candidate, fitted parameters, curves ..., by the kind of study."""
        return self._get("answer", lambda: self._lab._http.json("GET", self._part(self._table_part + ".json")))

    def _read(self) -> tuple[list[dict[str, Any]], dict[str, str]]:
        if self.kind == "tradeoff":  # the only study without a CSV file
            return [{**point, **(point.pop("errors") or {})} for point in copy.deepcopy(self.answer["points"])], {}
        return self._get("table", lambda: _read_csv(
            self._lab._http.request("GET", self._part(self._table_part + ".csv")).body.decode()))

    @property
    def table(self) -> Any:
        """One row per run, candidate, parameter or point: a DataFrame, or a list of dicts without pandas.

        The columns of varied members are named as overrides are, "dampers.0.clearance"; `study.table_units` has units."""
        rows, units = self._read()
        return _table(rows, units)

    @property
    def table_units(self) -> dict[str, str]:
        """The units of the columns of `table`; a column without a unit is absent."""
        return self._read()[1]

    @property
    def frame(self) -> Any:
        """`table` as a pandas DataFrame; ImportError without pandas."""
        _required("pandas", "frame")
        return self.table

    def _whole(self) -> dict[str, Any]:
        return self.answer

    def best(self, metric: Optional[str] = None, goal: str = "minimize") -> dict[str, Any]:
        """The best row of the table.

        Of an optimisation it is the best candidate: its values, its objectives, "feasible". Of a calibration the
        fitted values. Of any other study the row with the smallest `metric`, with goal="maximize" the largest; by
        default rms_displacement, or the first metric of a sweep without it.
        """
        if metric is None and self.kind in ("optimize", "calibrate"):
            return self._solution()
        rows = [row for row in self._read()[0] if self._is_number(row, metric or self._metric())]
        metric = metric or self._metric()
        if not rows:
            names = ", ".join(self._read()[0][0]) if self._read()[0] else "none"
            raise KeyError(f"no row of the table has a number in {metric!r}; its columns are {names}")
        return dict((max if goal == "maximize" else min)(rows, key=lambda row: row[metric]))

    @staticmethod
    def _is_number(row: Mapping[str, Any], name: str) -> bool:
        return isinstance(row.get(name), (int, float)) and row[name] == row[name]

    def _metric(self) -> str:
        rows, metrics = self._read()[0], self.document["scene"]["study"].get("metrics")
        return metrics[0] if metrics and rows and "rms_displacement" not in rows[0] else "rms_displacement"

    def _solution(self) -> dict[str, Any]:
        if self.kind == "calibrate":
            return self._values(self.answer["parameters"])
        best = self.answer["best"]
        if best is None:
            raise Problem({"title": "No candidate meets the constraints", "status": 422,
                           "errors": self.answer["warnings"]})
        objectives = {one["metric"]: one["value"] for one in best["objectives"]}
        return {**self._values(best["values"]), **objectives, "feasible": best["feasible"]}

    @staticmethod
    def _values(axes: list[dict[str, Any]]) -> dict[str, Any]:
        return {_dotted(name): one["value"] for one in axes for name in one["pointers"] or [one["pointer"]]}

    def _rows(self) -> list[tuple[str, str]]:
        rows = [("study", self.kind), ("rows of the table", str(len(self._read()[0])))]
        if self.kind in ("sweep", "optimize", "calibrate") and not (self.kind == "optimize" and self.answer["best"] is None):
            units = self.table_units
            rows += [(f"best {name}", f"{value:.6g} {units.get(name, '')}" if isinstance(value, float) else str(value))
                     for name, value in self.best().items() if self.kind != "sweep" or "." in name or name == self._metric()]
        return rows

    def best_scene(self, metric: Optional[str] = None, goal: str = "minimize") -> dict[str, Any]:
        """The scene of `best()`, ready for `lab.run`. For sweeps, optimisations and calibrations."""
        if self.kind in ("optimize", "calibrate"):
            return self._lab._http.json("GET", self._part(self._table_part + "/scene"))
        return self._lab._http.json("GET", self._part(f"points/{self.best(metric, goal)['index']}/scene"))

    def plot(self, *columns: str, figure: Any = None) -> Any:
        """A Matplotlib figure of columns of the table over the first varied member, of a response over "value".

            lab.sweep(scene, {"dampers.0.clearance": (0.005, 0.025, 21)}).plot("rms_displacement")
        """
        pyplot = _required("matplotlib.pyplot", "plot")
        rows = self._read()[0]
        names = [name for name in (rows[0] if rows else {}) if name not in ("index", "branch", "seed", "steps")
                 and any(self._is_number(row, name) and not isinstance(row[name], bool) for row in rows)]
        across = next((name for name in names if "." in name or name in ("value", "level")), None)
        names = list(columns) or [name for name in names if name != across][:3]
        figure = figure or pyplot.figure(figsize=(8, 1 + 2.2 * len(names)), layout="constrained")
        for axis, name in zip(figure.subplots(len(names), 1, squeeze=False)[:, 0], names):
            points = [(row[across] if across else i, row[name]) for i, row in enumerate(rows) if self._is_number(row, name)]
            axis.plot([x for x, _ in points], [y for _, y in points], ".")
            axis.set_ylabel(name + self._unit(name))
            axis.set_xlabel((across or "row") + self._unit(across))
        return figure

    def _unit(self, name: Optional[str]) -> str:
        return f" [{self.table_units[name]}]" if name in self.table_units else ""


# --- the server ---

def connect(url: Optional[str] = None, token: Optional[str] = None, *, ca_file: Optional[str] = None,
            timeout: float = 60, patience: float = 600, cancel_on_interrupt: bool = False) -> Lab:
    """Connects to a server and returns a Lab.

    url       its address; by default that of IMPACTD_SERVER, else http://127.0.0.1:8080.
    token     needed beyond loopback (`impactd token create`); by default that of IMPACTD_TOKEN.
    ca_file   file of the certificate authority, where the server's certificate is not signed by a public one.
    timeout   seconds until a server that does not answer is given up.
    patience  seconds for which requests are repeated while the queue is full or the token's quota is used up.
    cancel_on_interrupt   whether Ctrl-C in run, a study or gather cancels the jobs; otherwise they continue.

    A Lab may be used by many threads. It closes its connections at the end of a `with` block:

        with impactd.connect("https://sim.example.org", token) as lab:
            ...
    """
    return Lab(url or os.environ.get("IMPACTD_SERVER") or "http://127.0.0.1:8080",
               token or os.environ.get("IMPACTD_TOKEN") or None, ca_file, timeout, patience, cancel_on_interrupt)


def _reopened(*arguments: Any) -> _Http:
    url, *others = arguments
    return _Http(url, os.environ.get("IMPACTD_TOKEN"), *others)


class Lab:
    """A server, as `connect` returns it. A scene is one of these:

    - a dict, as in the scene reference.
    - the path of a JSON file: a string that ends with ".json", or a pathlib.Path.
    - the name of an example (`lab.examples()`), such as "paper_free_sponge". A file of that name in the current
      folder comes first.
    - a Result, whose scene is used.

    Keywords change the scene: `**{"dampers.0.clearance": 0.01}`, also as JSON Pointers, `"/dampers/0/clearance"`, and
    plain names, `duration=5`. A path that the scene cannot have raises Problem. The given scene is never changed.
    """

    def __init__(self, url: str, token: Optional[str], ca_file: Optional[str], timeout: float, patience: float,
                 cancel_on_interrupt: bool):
        self._http = _Http(url, token, ca_file, timeout, patience)
        self._cancels = cancel_on_interrupt
        self._examples: dict[str, Any] = {}
        self.version: dict[str, Any] = self._http.json("GET", "/version", has=("version",))

    @property
    def url(self) -> str:
        return self._http.url

    def close(self) -> None:
        """Closes the connections; a later request opens new ones."""
        self._http.close()

    def __enter__(self) -> Lab:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return _clean(f"<impactd.Lab {self.url}, impactd {self.version['version']}>")

    def request(self, method: str, path: str, document: Any = None) -> Any:
        """Any other call of the API: `lab.request("GET", "/v1/cache")`. Sends and returns JSON."""
        return self._http.json(method, path, document)

    # --- scenes ---

    def examples(self) -> list[str]:
        """Names of the scenes that come with the server."""
        return [one["name"] for one in self._http.json("GET", "/v1/examples", has=("examples",))["examples"]]

    @staticmethod
    def _file(path: Union[str, os.PathLike[str]]) -> dict[str, Any]:
        with open(path, encoding="utf-8") as file:
            try:
                document = json.load(file)
            except (ValueError, RecursionError) as error:
                raise ValueError(f"{os.fspath(path)!r} is not a JSON file: {error}") from None
        if not isinstance(document, dict):
            raise ValueError(f"{os.fspath(path)!r} is not a scene: it must be a JSON object")
        return document

    def scene(self, scene: Scene, **overrides: Any) -> dict[str, Any]:
        """The scene as a dict of its own, with overrides: what `run` sends.

            lab.scene("paper_free_sponge", **{"excitation.displacement": 0.02}, duration=5)
        """
        if isinstance(scene, Result):
            document = scene.scene
        elif isinstance(scene, collections.abc.Mapping):
            document = scene
        elif not isinstance(scene, (str, os.PathLike)):
            raise TypeError("a scene is a dict, the path of a JSON file, the name of an example or a Result, "
                            f"not a {type(scene).__name__}" + ("; submit takes lists" if isinstance(scene, list) else ""))
        elif not scene:
            raise ValueError("a scene is a dict, the path of a JSON file, the name of an example or a Result; "
                             "this is an empty string")
        elif isinstance(scene, os.PathLike) or scene.endswith(".json") or os.path.isfile(scene):
            document = self._file(scene)
        else:
            if scene not in self._examples:
                self._examples[scene] = self._http.json("GET", f"/v1/examples/{_name(scene)}")
            document = self._examples[scene]
        document = copy.deepcopy(dict(document))
        for path, value in overrides.items():
            _set(document, path, value)
        return document

    def check(self, scene: Scene, **overrides: Any) -> dict[str, Any]:
        """Validates a scene and predicts its cost; runs nothing. "cost" has "cpu_seconds" and "bytes"."""
        return self._http.json("POST", "/v1/jobs?dry_run=1", self.scene(scene, **overrides))

    # --- runs ---

    def _post(self, scene: Mapping[str, Any], prefer: str, key: Optional[str] = None) -> Job:
        # A retry under the same key cannot run the scene twice.
        headers = {"Idempotency-Key": key or uuid.uuid4().hex, "Prefer": prefer}
        return Job(self, self._http.json("POST", "/v1/jobs", scene, headers, _JOB))

    def _finish(self, scene: Mapping[str, Any], timeout: Optional[float], progress: Progress) -> Result:
        key, job = uuid.uuid4().hex, None
        end = None if timeout is None else time.monotonic() + timeout
        longest = min(self._http.timeout / 2, 2 if timeout is None else timeout)  # wait= takes whole seconds
        try:
            job = self._post(scene, "wait=2" if longest >= 2 else "respond-async", key)
            shown = _Progress(progress, 100, "%")
            while not job.is_finished and progress and (end is None or time.monotonic() < end):
                shown(int(job.progress))
                job.refresh(0.5)
            job._wait(timeout, end)
            shown(100)
            return job.result()
        except KeyboardInterrupt:
            if self._cancels:
                (job or self._post(scene, "respond-async", key)).cancel()
            raise

    def run(self, scene: Scene, *, timeout: Optional[float] = None, progress: Progress = False,
            **overrides: Any) -> Result:
        """Runs a scene and returns its Result. Raises Problem with all faults if the scene is refused or fails.

        timeout   seconds to wait; then TimeoutError, and the job continues.
        progress  True: a line on standard error; or a function that is called with (per cent, 100).

            r = lab.run("paper_free_sponge", **{"dampers.0.clearance": 0.01}, duration=5)
        """
        return self._finish(self.scene(scene, **overrides), timeout, progress)

    def submit(self, scenes: Union[Scene, Iterable[Scene]], **overrides: Any) -> Any:
        """Submits a scene and returns its Job at once; of a list of scenes a list of Jobs in the same order.

        While the queue of the server is full, this waits as long as the server says. Each scene is sent with an
        Idempotency-Key of its own, so that a repeated request cannot run it twice. If one scene of a list is refused, the
        others are cancelled and its Problem is raised.
        """
        if isinstance(scenes, (collections.abc.Mapping, str, os.PathLike, Result)):
            return self._post(self.scene(scenes, **overrides), "respond-async")
        documents = [self.scene(one, **overrides) for one in scenes]
        jobs: list[Any] = [None] * len(documents)
        for index, job in _parallel(lambda document: self._post(document, "respond-async"), documents):
            jobs[index] = job
        for index, error in enumerate(jobs):
            if isinstance(error, Exception):
                for job in jobs:
                    if isinstance(job, Job):
                        job.cancel()
                if isinstance(error, Problem):
                    error.title = f"Item {index} of the list: {error.title}"
                raise error
        return jobs

    def gather(self, jobs: Iterable[Union[Job, Scene]], *, ordered: bool = False, errors: str = "raise",
               progress: Progress = False, cancel: Optional[bool] = None) -> Iterator[Any]:
        """Yields the Result of each job as it finishes, with ordered=True in the given order.

        errors    "raise": the Problem of a failed job is raised; "return": it is yielded in the place of the result.
        progress  True: a line on standard error; or a function that is called with (done, total).
        cancel    whether Ctrl-C, or a loop that is left early, cancels the jobs that are not finished; by default as
                  `cancel_on_interrupt` of connect says.

            jobs = lab.submit(lab.scene("paper_random_sponge", **{"excitation.seed": i}) for i in range(100))
            for r in lab.gather(jobs):
                print(r.summary["rms_displacement"])
        """
        if isinstance(jobs, (collections.abc.Mapping, str, os.PathLike, Result, Job)):
            jobs = [jobs]
        jobs = [job if isinstance(job, Job) else self.submit(job) for job in jobs]
        shown, waiting, place = _Progress(progress, len(jobs), "jobs"), {}, 0
        try:
            for count, (index, result) in enumerate(_parallel(lambda job: job.result(), jobs), 1):
                shown(count)
                waiting[index] = result
                while (place if ordered else index) in waiting:
                    result = waiting.pop(place if ordered else index)
                    place += 1
                    if isinstance(result, Exception) and not (errors == "return" and isinstance(result, Problem)):
                        raise result
                    yield result
        except (KeyboardInterrupt, GeneratorExit):
            if self._cancels if cancel is None else cancel:
                for job in jobs:
                    if not job.is_finished:
                        job.cancel()
            raise

    # --- studies ---

    def study(self, kind: str, scene: Scene, *, timeout: Optional[float] = None,
              progress: Progress = False, **members: Any) -> Study:
        """Runs a study of any kind: the general call behind sweep, ensemble, optimize and the others.

        Keywords with a dot or a slash, and the scene's own members (duration, output ...), change the scene; all others
        are members of the study, as in the reference:

            lab.study("ensemble", scene, runs=100, **{"dampers.0.clearance": 0.01})
        """
        overrides = {name: members.pop(name) for name in list(members)
                     if "." in name or "/" in name or name in _SCENE_MEMBERS}
        document = self.scene(scene, **overrides)
        given = document.get("study") or {}
        document["study"] = {**(given if given.get("kind") == kind else {}), "kind": kind,
                             **{name: value for name, value in members.items() if value is not None}}
        result = self._finish(document, timeout, progress)
        assert isinstance(result, Study)
        return result

    def sweep(self, scene: Scene, axes: Any = None, metrics: Optional[Sequence[str]] = None, **members: Any) -> Study:
        """Runs the scene at many points, by default all combinations of the axes.

        axes  {path: values}: a list or an array; a tuple (from, to, count); or a dict with more, such as
              {"from": 1, "to": 100, "count": 50, "spacing": "logarithmic"}. A tuple of paths gets the same value at all of them.

            s = lab.sweep("paper_free_sponge", {"dampers.0.clearance": (0.005, 0.025, 21),
                                                "dampers.0.buffer": ["sponge", "aluminium"]})
            s.table, s.best("rms_displacement"), s.best_scene("rms_displacement")
        """
        return self.study("sweep", scene, axes=_axes(axes), metrics=metrics, **members)

    def ensemble(self, scene: Scene, runs: Optional[int] = None, inputs: Any = None, **members: Any) -> Study:
        """Runs the scene with many seeds of its random base, or with uncertain inputs; answer["statistics"] has means
        with confidence intervals, `table` one row per run.

            lab.ensemble("paper_random_sponge", runs=100)
            lab.ensemble(scene, 256, inputs={"dampers.0.clearance": {"distribution": "uniform", "from": 0.013, "to": 0.017}})
        """
        return self.study("ensemble", scene, runs=runs, inputs=_axes(inputs), **members)

    def optimize(self, scene: Scene, variables: Any = None, objectives: Any = None, constraints: Any = None,
                 **members: Any) -> Study:
        """Finds the values that make one or two metrics best; `best()` has them, `best_scene()` is the scene.

        variables    {path: (from, to)} or {path: [values]}
        objectives   a metric, a list of metrics, or {metric: "minimize" or "maximize"}
        constraints  {metric: (min, max)}, None for no limit on that side

            s = lab.optimize("paper_random_sponge", {"dampers.0.clearance": (0.002, 0.06)}, "rms_displacement",
                             over={"runs": 16}, max_candidates=40)
        """
        if isinstance(objectives, str):
            objectives = [objectives]
        if isinstance(objectives, collections.abc.Mapping):
            objectives = [{"metric": metric, "goal": goal} for metric, goal in objectives.items()]
        elif objectives is not None:
            objectives = [{"metric": one} if isinstance(one, str) else one for one in objectives]
        if isinstance(constraints, collections.abc.Mapping):
            constraints = [{"metric": metric, **({} if low is None else {"min": low}), **({} if high is None else {"max": high})}
                           for metric, (low, high) in constraints.items()]
        return self.study("optimize", scene, variables=_axes(variables), objectives=objectives,
                          constraints=constraints, **members)

    def calibrate(self, scene: Scene, parameters: Any = None, measured: Any = None, **members: Any) -> Study:
        """Fits parameters to a measured motion; `best()` has the values, answer["parameters"] their intervals.

        parameters  {path: (from, to)}
        measured    a list of {"channel", "samples", "interval" [s], "start" [s], "deviation"}

            lab.calibrate(scene, {"dampers.0.buffer.restitution": (0.3, 0.9)},
                          [{"channel": "displacement", "samples": x, "interval": 0.001}])
        """
        if isinstance(measured, collections.abc.Mapping):
            measured = [measured]
        return self.study("calibrate", scene, parameters=_axes(parameters), measured=measured, **members)

    def response(self, scene: Scene, axis: Any = None, **members: Any) -> Study:
        """The steady motion under a sine while one number varies: periods, stability, peaks.

            lab.response("response_sponge", {"excitation.frequency": (3, 5, 81)}, direction="both")
        """
        if isinstance(axis, collections.abc.Mapping) and "pointer" not in axis and "pointers" not in axis:
            axis = _axes(axis)[0]
        return self.study("response", scene, axis=axis, **members)

    def fragility(self, scene: Scene, records: Optional[Sequence[str]] = None, levels: Any = None, limits: Any = None,
                  **members: Any) -> Study:
        """The intensity of ground motions at which limits are exceeded.

        records  names of uploaded ground motions
        levels   peak accelerations [m/s^2], a list or (from, to, count)
        limits   {metric: value}

            lab.fragility(scene, ["elcentro", "kobe"], (0.5, 10, 20), {"peak_displacement": 0.02})
        """
        if isinstance(levels, tuple) and len(levels) == 3:
            levels = dict(zip(("from", "to", "count"), levels))
        if isinstance(limits, collections.abc.Mapping):
            limits = [{"metric": metric, "value": value} for metric, value in limits.items()]
        return self.study("fragility", scene, records=records, levels=levels, limits=limits, **members)

    def compare(self, scene: Scene, models: Optional[Sequence[str]] = None, **members: Any) -> Study:
        """The scene under several contact models: `lab.compare("paper_free_sponge", ["impulse", "spring_damper"])`."""
        return self.study("compare", scene, models=models, **members)

    def sensitivity(self, scene: Scene, **members: Any) -> Study:
        """How errors of restitution, contact time, mass and clearance change the response."""
        return self.study("sensitivity", scene, **members)

    def tradeoff(self, scene: Scene, **members: Any) -> Study:
        """Error against CPU time of every solver on this scene."""
        return self.study("tradeoff", scene, **members)

    # --- what the server has ---

    def jobs(self, limit: Optional[int] = 100, **filters: Any) -> Any:
        """A table of jobs, newest first. Filters: status, q (text in title or labels), label, kind, since, until."""
        rows = self._http.pages(_query("/v1/jobs", limit=min(limit or 100, 100), **filters), "jobs", limit)
        for row in rows:
            row.pop("links", None)
        return _table(rows)

    def job(self, id: str) -> Job:
        """A job by its id, which may be shortened to "j-" and eight digits."""
        return Job(self, self._http.json("GET", f"/v1/jobs/{_name(id)}", has=_JOB))

    def result(self, id: str) -> Result:
        """A result or a study by its id, which may be shortened to "r-" and eight digits."""
        document = self._http.json("GET", f"/v1/results/{_name(id)}", has=_RESULT)
        result = (Study if document.get("study") else Result)(self, document["id"])
        result._kept["document"] = document
        return result

    def materials(self, **filters: Any) -> Any:
        """A table of the buffer materials. Filters: q (text), kind, status, e="0.4..0.7", T_c="0.01..0.03" [s].

            lab.materials(kind="foam")
        """
        return _table([self._flat(one) for one in self._http.pages(_query("/v1/materials", **filters), "materials")])

    def material(self, name: str) -> dict[str, Any]:
        """A material's approved revision, "sponge", or one of its revisions, "sponge@1"."""
        return self._http.json("GET", f"/v1/materials/{_name(name)}")

    def add_material(self, slug: str, name: str, **members: Any) -> dict[str, Any]:
        """Adds a material; contact_time in s. Further keywords as in the reference of materials.

            lab.add_material("felt", "Felt, 5 mm", restitution=0.31, contact_time=0.0042, source="own tests")
        """
        return self._http.json("POST", "/v1/materials", {"slug": slug, "name": name, **members})

    def derived(self, material: str, damper_mass: float, structure_mass: float, **options: Any) -> dict[str, Any]:
        """Stiffness [N/m] and damping [N s/m] of a material between two masses [kg], with their uncertainty."""
        return self._http.json("GET", _query(f"/v1/materials/{_name(material)}/derived", damper_mass=damper_mass,
                                             structure_mass=structure_mass, **options))

    def measure(self, material: str, test: Mapping[str, Any], dry_run: bool = False) -> dict[str, Any]:
        """Stores a drop test of a material and returns its evaluation: restitution and contact time with intervals.

        With dry_run=True it is only evaluated.

            lab.measure("felt", {"impactor_mass": 0.11, "base": "fixed",
                                 "drops": [{"drop_height": 0.05, "rebound_height": 0.018}]})
        """
        return self._http.json("POST", f"/v1/materials/{_name(material)}/measurements" + ("?dry_run=1" if dry_run else ""), test)

    def measurements(self, material: str) -> list[dict[str, Any]]:
        """The drop tests of a material, newest first, with their evaluations."""
        return self._http.pages(f"/v1/materials/{_name(material)}/measurements", "measurements")

    def records(self, **filters: Any) -> Any:
        """A table of the ground motions; q="..." searches names and sources."""
        return _table([self._flat(one) for one in self._http.pages(_query("/v1/records", **filters), "records")])

    def record(self, name: str) -> dict[str, Any]:
        """A ground motion: interval [s], peak [m/s^2], source, digest and the number of its uses."""
        return self._http.json("GET", f"/v1/records/{_name(name)}")

    def record_samples(self, name: str) -> tuple[Any, Any]:
        """Times [s] and accelerations [m/s^2] of a ground motion."""
        times, samples = _read_npy(self._http.request("GET", f"/v1/records/{_name(name)}/samples.npy").body)
        return times, samples

    def upload(self, name: str, motion: Any, interval: Optional[float] = None, **members: Any) -> dict[str, Any]:
        """Uploads a ground motion: the path of a file (AT2, COSMOS, V1, two columns ...), or samples with their interval [s].

        Keywords: unit ("g", "m/s^2" or "cm/s^2"), source, processing, earthquake, station, notes. The same motion under
        the same name may be uploaded again.

            lab.upload("elcentro", "RSN6_IMPVALL.I_I-ELC180.AT2", source="PEER, RSN6")
            lab.upload("pulse", [0, 1, 0], interval=0.02)
        """
        if isinstance(motion, (str, os.PathLike)):
            with open(motion, "rb") as file:
                text = file.read()
            return self._http.request("POST", _query("/v1/records", name=name, interval=interval, **members), text,
                                      {"Content-Type": "text/plain"}).json()
        return self._http.json("POST", "/v1/records", {"name": name, "interval": interval, "samples": motion, **members})

    @staticmethod
    def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
        return {name: value for name, value in row.items() if name != "links"}
