#!/usr/bin/env python3
"""Every #include and every call obeys the rooms: who may include whom, where foreign libraries live, what nobody calls.

Reads the sources only; compiles nothing."""

import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

# Floors from the ground up. A room may include itself, every floor below, and on its own floor the rooms
# named before it: the order is total, so circles cannot be built. The server may include all of the core.
FLOORS = {
    "core": [["base", "math"], ["contact", "excitation", "result"], ["scene"], ["plan", "drop_test", "formats"], ["solve"],
             ["simulation"], ["study"]],
    "server": [["util", "json", "db"], ["materials", "auth", "jobs"], ["formats", "http"], ["api"],
               ["options", "options_show", "cli", "main", "install"]],
}

# The C library as the two halves may use it, and the processor's vectors. Not here: files, clocks, threads and
# processes in the core.
PURE = set("assert complex ctype errno float immintrin inttypes limits math stdalign stdarg stdatomic stdbool "
           "stddef stdint stdio stdlib string".split())
SYSTEM = PURE | set("dirent fcntl ftw grp libgen locale netdb poll pthread pwd sched semaphore signal spawn strings "
                    "termios time unistd arpa/inet net/if netinet/in netinet/tcp sys/epoll sys/eventfd "
                    "sys/file sys/ioctl sys/mman sys/prctl sys/random sys/resource sys/select sys/socket sys/stat "
                    "sys/statvfs sys/time sys/types sys/un sys/wait wctype".split())

MHD_FILES = [f"server/http/{name}" for name in ("event_loop.c", "connection.c", "connection.h")]

# One room per foreign library: header -> the only files or folders that may include it.
FOREIGN = {
    "microhttpd.h": MHD_FILES,
    "malloc.h": ["server/util/process.c"],
    "sqlite3.h": ["server/db/sqlite.c"],
    "jansson.h": ["server/json/"],
    "fftw3.h": ["core/math/fft.c"],
    "lapacke.h": ["core/math/symmetric_matrix.c", "core/math/linear_system.c"],
    "nlopt.h": ["core/study/search.c"],
    "arkode/": ["core/solve/adaptive.c"],
    "nvector/": ["core/solve/adaptive.c"],
    "gnutls/": ["server/util/sha256.c", "server/http/tls.c"],
    "libdeflate.h": ["server/util/gzip.c"],
    "curl/": ["server/cli/client.c"],
    "dragonbox/": ["server/util/dtoa.cpp"],
    "cmark-gfm.h": ["server/install/guide.c"],
    "cmark-gfm-core-extensions.h": ["server/install/guide.c"],
}

# Calls -> (why, where they are allowed all the same).
BANNED = {
    r"v?sprintf|strcpy|strcat|strncpy|strncat|stpcpy|gets": ("has no limit", []),
    r"atoi|atol|atoll|atof|[fsv]*scanf": ("reads faults as numbers", []),
    r"strtok|rand|srand|random|srandom|drand48|localtime|gmtime|asctime|ctime|setlocale":
        ("has hidden state", []),
    r"system|popen|alloca|mktemp|tmpnam|tempnam|setjmp|longjmp": ("is not for a daemon", []),
    r"exit|_exit|_Exit|abort|quick_exit": ("errors are returned", ["server/main.c", "server/cli/files.c", "server/cli/chunk.c"]),
    r"clock_gettime|gettimeofday|time|clock": ("the clock is util/clock.c's", ["server/util/clock.c"]),
    r"json_object_\w+|json_array_\w+|json_loadb|json_loads|json_dumps": ("JSON is read in json/", ["server/json/"]),
    r"sqlite3_\w+": ("SQLite is db/sqlite.c's", ["server/db/sqlite.c"]),
    r"MHD_\w+": ("libmicrohttpd is http's", MHD_FILES),
    r"fftw_\w+": ("FFTW is fft.c's", ["core/math/fft.c"]),
    r"LAPACKE_\w+": ("LAPACK is core/math's", ["core/math/symmetric_matrix.c", "core/math/linear_system.c"]),
    r"nlopt_\w+": ("NLopt is search.c's", ["core/study/search.c"]),
    r"gnutls_\w+": ("GnuTLS is sha256.c's and tls.c's", ["server/util/sha256.c", "server/http/tls.c"]),
    r"libdeflate_\w+": ("libdeflate is gzip.c's", ["server/util/gzip.c"]),
    r"curl_\w+": ("libcurl is cli/client.c's", ["server/cli/client.c"]),
}
CORE_BANNED = {
    r"fopen|fclose|fread|fwrite|fprintf|printf|puts|putchar|fputs|fputc|perror|getenv|remove|rename":
        ("the core has no files, logs or environment", []),
}


def without_comments(text, keep_strings):
    """C text with comments, and if asked strings, blanked; line numbers stay."""
    pattern = re.compile(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'", re.S)

    def blank(match):
        found = match.group(0)
        if found[0] in "\"'" and keep_strings:
            return found
        return re.sub(r"[^\n]", " ", found)

    return pattern.sub(blank, text)


def room(path):
    """("core", "base") of "core/base/field.c"; ("server", "main") of "server/main.c"."""
    parts = path.split("/")
    return parts[0], parts[1] if len(parts) > 2 else re.sub(r"\.\w+$", "", parts[1])


def height(half, name):
    """The place of a room in the total order; None if there is no such room."""
    rooms = [one for floor in FLOORS[half] for one in floor]
    return rooms.index(name) if name in rooms else None


def check_own(path, target, exists):
    half, name = room(path)
    if not exists(target):
        return f'"{target}": no such file; include by whole path from the top'
    other_half = target.split("/")[0]
    if other_half not in FLOORS:
        return f'"{target}" is neither core/ nor server/'
    if half == "core" and other_half == "server":
        return f'"{target}": core/ must not know server/'
    if half == other_half and height(half, room(target)[1]) is None:
        return f'"{target}" is in a room without a floor'
    if half == other_half and height(half, name) < height(half, room(target)[1]):
        return f'"{target}": {half}/{room(target)[1]} is above {half}/{name}'
    return None


def check_foreign(path, target):
    for header, places in FOREIGN.items():
        if target == header or header.endswith("/") and target.startswith(header):
            if any(path == place or place.endswith("/") and path.startswith(place) for place in places):
                return None
            return f"<{target}> belongs to {', '.join(places)} alone"
    if path.endswith(".cpp"):
        return None if "." not in target else f"<{target}> is not known here"
    pure = target[:-2] if target.endswith(".h") else target
    if path.startswith("core/") and pure not in PURE:
        return f"<{target}> is not the C library's pure part"
    if pure not in SYSTEM:
        return f"<{target}> is foreign: give it util/clock.c's and name that in test_includes.py"
    return None


def faults(path, text, exists):
    """All faults of one source as "path:line: what"."""
    found = []
    half, name = room(path)
    if height(half, name) is None:
        found.append(f"{path}:1: {half}/{name} is a room without a floor; name it in test_includes.py")
        return found
    for number, line in enumerate(without_comments(text, True).splitlines(), 1):
        include = re.match(r"\s*#\s*include\b\s*(.*)", line)
        if not include:
            continue
        own, foreign = re.match(r'"([^"]+)"', include.group(1)), re.match(r"<([^>]+)>", include.group(1))
        fault = (check_own(path, own.group(1), exists) if own
                 else check_foreign(path, foreign.group(1)) if foreign
                 else "an include that cannot be read")
        if fault:
            found.append(f"{path}:{number}: {fault}")
    rules = {**BANNED, **(CORE_BANNED if half == "core" else {})}
    code = without_comments(text, False)
    for pattern, (why, places) in rules.items():
        if any(path == place or place.endswith("/") and path.startswith(place) for place in places):
            continue
        # A call or the taking of an address; members (x.time, x->time) and declarations of data are not meant.
        for match in re.finditer(rf"(?<![\w.>])({pattern})\s*\(", code):
            line = code.count("\n", 0, match.start()) + 1
            found.append(f"{path}:{line}: {match.group(1)}: {why}")
    if path.endswith(".h"):
        guard = re.sub(r"\W", "_", path).upper()
        if f"#ifndef {guard}\n#define {guard}\n" not in text:
            found.append(f"{path}:1: its include guard is not {guard}")
        if not text.startswith("//"):
            found.append(f"{path}:1: a header opens by saying what it is")
    return found


def sources():
    for half in FLOORS:
        for folder, _, files in os.walk(os.path.join(program.SOURCE, half)):
            for file in files:
                if file.endswith((".c", ".h", ".inc", ".cpp")):
                    path = os.path.relpath(os.path.join(folder, file), program.SOURCE)
                    with open(os.path.join(program.SOURCE, path), encoding="utf-8") as source:
                        yield path, source.read()


def exists(target):
    return os.path.isfile(os.path.join(program.SOURCE, target))


def test_sources_obey_the_rooms():
    """Every include, foreign header and call in core/ and server/ is where it may be."""
    found, count = [], 0
    for path, text in sources():
        count += 1
        found += faults(path, text, exists)
    assert count > 30, f"only {count} sources were found"
    assert not found, "\n" + "\n".join(sorted(found))


def test_headers_have_no_circles():
    """No header includes itself by way of others."""
    graph = {path: re.findall(r'^\s*#\s*include\s*"([^"]+)"', text, re.M)
             for path, text in sources() if path.endswith(".h")}
    state = {}

    def walk(path, trail):
        assert state.get(path) != "open", " > ".join(trail + [path])
        if state.get(path) == "done":
            return
        state[path] = "open"
        for target in graph.get(path, []):
            walk(target, trail + [path])
        state[path] = "done"

    for path in graph:
        walk(path, [])


PLANTED = [
    ("core/base/x.c", '#include "core/plan/plan.h"\n', "above"),
    ("core/scene/x.c", '#include "core/simulation/simulation.h"\n', "above"),
    ("core/plan/x.c", '#include "server/util/bytes.h"\n', "must not know server/"),
    ("core/plan/x.c", '#include "plan.h"\n', "no such file"),
    ("core/plan/x.c", "#include <pthread.h>\n", "pure part"),
    ("core/plan/x.c", "  #  include  <time.h>\n", "pure part"),
    ("core/plan/x.c", "#include <fftw3.h>\n", "alone"),
    ("core/plan/x.c", 'void f(void) { printf("x"); }\n', "no files"),
    ("core/rooms/x.c", "\n", "without a floor"),
    ("server/db/x.c", '#include "server/jobs/job.h"\n', "above"),
    ("server/jobs/x.c", '#include "server/http/request.h"\n', "above"),
    ("server/api/x.c", "#include <microhttpd.h>\n", "alone"),
    ("server/jobs/x.c", "#include <sqlite3.h>\n", "alone"),
    ("server/api/x.c", "#include <jansson.h>\n", "alone"),
    ("server/api/x.c", "#include <mysql/mysql.h>\n", "foreign"),
    ("server/api/x.c", "#include NAME\n", "cannot be read"),
    ("server/api/x.c", "int f(char *a, const char *b) { strcpy(a, b); }\n", "no limit"),
    ("server/api/x.c", "int f(char *a) { return atoi(a); }\n", "numbers"),
    ("server/api/x.c", "int f(void) { return sprintf (a, b); }\n", "no limit"),
    ("server/api/x.c", "int f(char *a) { return system(a); }\n", "daemon"),
    ("server/api/x.c", "char *f(char *a) { return strtok(a, b); }\n", "hidden state"),
    ("server/api/x.c", "void f(void) { exit(1); }\n", "returned"),
    ("server/api/x.c", "void f(void) { json_object_get(a, b); }\n", "read in json"),
    ("server/jobs/x.c", "void f(void) { sqlite3_bind_int(a, 1, 1); }\n", "db/sqlite.c"),
    ("server/jobs/x.c", "void f(void) { clock_gettime(0, &t); }\n", "clock"),
    ("server/jobs/x.h", "// What it is.\n#ifndef X_H\n#define X_H\n#endif\n", "guard"),
    ("server/jobs/x.h", "#ifndef SERVER_JOBS_X_H\n#define SERVER_JOBS_X_H\n#endif\n", "opens by"),
]
INNOCENT = [
    ("server/api/x.c", "// strcpy(a, b), #include <jansson.h>\n/*\n#include <sqlite3.h>\nexit(1) */\n"),
    ("server/api/x.c", 'const char *s = "strcpy(a, b); // system(x)"; int c = \'"\'; int d = f("\\"");\n'),
    ("server/api/x.c", "int mysprintf(int); int y = x.time(1) + p->exit(2) + strcpy_count;\n"),
    ("server/api/x.c", '#include "core/plan/plan.h"\n#include "server/http/request.h"\n#include <time.h>\n'),
    ("server/main.c", "int main(void) { exit(0); }\n"),
]


def test_planted_violations_are_found():
    """The checker finds each planted violation, once, and nothing in innocent look-alikes."""
    known = {"core/plan/plan.h", "core/simulation/simulation.h", "server/util/bytes.h",
             "server/jobs/job.h", "server/http/request.h"}
    for path, text, expected in PLANTED:
        found = faults(path, text, known.__contains__)
        assert len(found) == 1 and expected in found[0], (path, text, found)
    for path, text in INNOCENT:
        assert not faults(path, text, known.__contains__), (path, text, faults(path, text, known.__contains__))


if __name__ == "__main__":
    program.main(globals())
