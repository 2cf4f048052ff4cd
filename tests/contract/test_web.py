#!/usr/bin/env python3
"""The dashboard's files: what they may hold, how small they are, and that the daemon serves each as browsers need it."""

import fnmatch
import gzip
import hashlib
import os
import posixpath
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

WEB = os.path.join(program.SOURCE, "web")
MOST_PACKED = 250_000  # of all that the dashboard can load, each file as gzip
MOST_LINES = 400

TYPES = {".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8", ".svg": "image/svg+xml",
         ".html": "text/html; charset=utf-8", ".woff2": "font/woff2"}
DIRECTIVES = {"default-src": "'none'", "script-src": "'self'", "style-src": "'self'", "img-src": "'self' blob:", "font-src": "'self'", "connect-src": "'self'",
              "base-uri": "'none'", "form-action": "'none'", "frame-ancestors": "'none'", "require-trusted-types-for": "'script'",
              "trusted-types": "'none'"}

# What the page's policy forbids or would have to forbid: pattern -> what it is.
FORBIDDEN = {
    r"\b(?:inner|outer)HTML\b": "markup from text", r"\binsertAdjacentHTML\b": "markup from text",
    r"\bdocument\.write": "markup from text", r"\bDOMParser\b": "markup from text", r"\bcreateContextualFragment\b": "markup from text",
    r"(?<![\w.])eval\s*\(": "code from text", r"\bnew Function\b": "code from text",
    r"\bset(?:Timeout|Interval)\(\s*[\"'`]": "code from text", r"setAttribute\(\s*[\"'](?:style|on)": "an inline style or handler",
    r"\bconsole\.": "a line on the console", r"\bXMLHttpRequest\b|\bWebSocket\b|\bsendBeacon\b|\bEventSource\b": "a request beside api.js",
    r"\b(?:https?|wss?):(?://|\\/\\/)(?!…|www\.w3\.org/|doi\.org/)": "the address of a host",
}


def own_files():
    """Paths from web/ of all files of the dashboard: neither those of vendor/ nor the guide, nor the style of reports."""
    found = []
    for folder, folders, files in os.walk(WEB):
        if folder == WEB:
            folders.remove("vendor")
            folders.remove("guide")
        found += [os.path.relpath(os.path.join(folder, file), WEB) for file in files]
    return sorted(set(found) - {"report.css"})


def embedded(path):
    return os.path.splitext(path)[1] in TYPES


def text(path):
    with open(os.path.join(WEB, path), encoding="utf-8") as file:
        return file.read()


def without_comments(source):
    return re.sub(r"^\s*//.*$|(?<=[;{},])\s+//.*$", "", re.sub(r"/\*.*?\*/", "", source, flags=re.S), flags=re.M)


def faults(path, source):
    """What is wrong with a file's text, a line each."""
    found = []
    code = source if path.endswith(".html") else without_comments(source)
    for pattern, what in FORBIDDEN.items():
        found += [f"{path}: {what}: {one[0]}" for one in re.finditer(pattern, code)]
    if path.endswith(".js"):
        if path != "js/api.js":
            found += [f"{path}: fetches; only js/api.js does"] * bool(re.search(r"(?<![\w.])fetch\s*\(", code))
        found += [f"{path}: does not begin with a comment on what it is"] * (not source.startswith("// "))
        found += [f"{path}: {source.count(chr(10))} lines"] * (source.count("\n") > MOST_LINES)
    if path.endswith(".html"):
        found += [f"{path}: inline: {one[0]}" for one in re.finditer(r"<style\b|<[^>]*\s(?:style|on\w+)\s*=|javascript:", source)]
        found += [f"{path}: inline script" for one in re.finditer(r"<script\b([^>]*)>(.*?)</script>", source, re.S)
                  if "src=" not in one[1] or one[2].strip()]
    if path.endswith(".css"):
        found += [f"{path}: {one[0]}" for one in re.finditer(r"@import|url\((?!\"(?:\.\./web/)?vendor/)", source)]
    return found


OF_THE_GUIDE = "vendor/dejavu/"  # its charts in text; no page of the dashboard loads it


def test_the_dashboard_is_small():
    """All that the page can load, libraries and fonts included, is at most 250 kB as gzip packs it."""
    sizes = {}
    for folder, folders, files in os.walk(WEB):
        if folder == WEB:
            folders.remove("guide")
            folders.remove("client")
        for path in (os.path.relpath(os.path.join(folder, file), WEB) for file in files):
            if embedded(path) and path != "report.css" and not path.startswith(OF_THE_GUIDE):
                with open(os.path.join(WEB, path), "rb") as file:
                    content = file.read()
                sizes[path] = len(content) if path.endswith(".woff2") else len(gzip.compress(content, 6, mtime=0))
    largest = sorted(sizes.items(), key=lambda one: -one[1])[:12]
    print(f"      {sum(sizes.values())} bytes in {len(sizes)} files")
    assert sum(sizes.values()) <= MOST_PACKED, f"{sum(sizes.values())} bytes; the largest: {largest}"


def test_vendored_files_are_unchanged_and_licensed():
    """Every file of web/vendor is the one that SHA256SUMS names, and each library has its licence beside it."""
    with open(os.path.join(WEB, "vendor", "SHA256SUMS"), encoding="ascii") as file:
        sums = dict(reversed(line.split(maxsplit=1)) for line in file.read().splitlines())
    sums = {posixpath.normpath(name.lstrip("*")): digest for name, digest in sums.items()}
    seen = set()
    for library in sorted(os.listdir(os.path.join(WEB, "vendor"))):
        folder = os.path.join(WEB, "vendor", library)
        if not os.path.isdir(folder):
            continue
        assert any(file.upper().startswith("LICEN") for file in os.listdir(folder)), f"{library} has no licence beside it"
        for file in os.listdir(folder):
            with open(os.path.join(folder, file), "rb") as content:
                assert hashlib.sha256(content.read()).hexdigest() == sums.get(f"{library}/{file}"), f"{library}/{file}"
            seen.add(f"{library}/{file}")
    assert seen and seen == set(sums), seen ^ set(sums)


def test_no_file_holds_what_the_policy_forbids():
    """No markup or code from text, nothing inline, no other host, fetch( in api.js alone; modules say what they are."""
    guide = [f"guide/{file}" for file in os.listdir(os.path.join(WEB, "guide"))] + ["report.css"]
    found = [fault for path in own_files() + guide if embedded(path) and not path.endswith(".svg") for fault in faults(path, text(path))]
    assert not found, "\n".join(found)


def test_planted_faults_are_found():
    """Each thing that is forbidden is found where it is planted."""
    for path, source in (("js/x.js", "node.innerHTML = x;"), ("js/x.js", "eval (x);"), ("js/x.js", "fetch (x);"),
                         ("js/x.js", 'a("https://example.org");'), ("js/x.js", "console.log(1);"), ("js/x.js", 'setTimeout("x()");'),
                         ("js/x.js", 'n.setAttribute("style", x);'), ("js/x.js", "let a;\n" * 401), ("x.css", "@import 'x';"),
                         ("x.html", '<p style="x">'), ("x.html", "<script>x</script>"), ("x.html", "<body onload=x>")):
        first = "// What it is.\n" if path.endswith(".js") else ""
        assert faults(path, first + source), source
    assert faults("js/x.js", "let a;") and not faults("js/x.js", "// See https://example.org, innerHTML.\nlet a; // eval(x)\n")


def imports(path):
    """Paths from web/ of what a file loads: modules by import, everything else by the page's tags. A preload is no use of a file."""
    if path.endswith(".html"):
        preloaded = set(re.findall(r'"modulepreload" href="web/([^"]+)"', text(path)))
        return {link.removeprefix("web/") for link in re.findall(r'(?:href|src)="(web/[^"]+)"', text(path))} - preloaded
    if not path.endswith(".js"):
        return set()
    source = without_comments(text(path))
    named = re.findall(r'(?:\bfrom|\bimport)\s*\(?\s*"(\.[^"]+)"', source)
    # `./${name}_page.js` may be any file of such a name.
    for template in re.findall(r"\bimport\(`\./([^`]+)`\)", source):
        pattern = re.sub(r"\$\{[^}]*\}", "*", template)
        fitting = fnmatch.filter(os.listdir(os.path.join(WEB, posixpath.dirname(path))), pattern)
        assert fitting, f"{path} imports {template}, and there is none"
        named += [f"./{one}" for one in fitting]
    return {posixpath.normpath(posixpath.join(posixpath.dirname(path), name)) for name in named}


def test_every_file_is_used_and_every_import_is_there():
    """From index.html imports lead to each file of web/, and none leads nowhere."""
    reached, ahead = set(), {"index.html"}
    while ahead:
        path = ahead.pop()
        assert os.path.isfile(os.path.join(WEB, path)), f"{path} is imported and not there"
        reached.add(path)
        ahead |= imports(path) - reached
    preloaded = set(re.findall(r'"modulepreload" href="web/([^"]+)"', text("index.html")))
    assert preloaded <= reached, sorted(preloaded - reached)
    unused = {path for path in own_files() if embedded(path) and not path.startswith(OF_THE_GUIDE)} - reached
    assert not unused, sorted(unused)


def policy(reply):
    words = [part.split(maxsplit=1) for part in reply.headers["content-security-policy"].split("; ")]
    return {word[0]: word[1] for word in words}


def test_the_daemon_serves_every_file():
    """Each with its type, entity tag (304), packed, under the strict policy, by HEAD too; unknown ones are 404."""
    with program.daemon() as daemon:
        for path in own_files():
            if not embedded(path) or path == "index.html":  # from /web/ the links of the page would lead nowhere
                assert daemon.get(f"/web/{path}").status == 404, path
                continue
            with open(os.path.join(WEB, path), "rb") as file:
                content = file.read()
            reply = daemon.get(f"/web/{path}")
            assert reply.status == 200 and reply.body == content, (path, reply)
            assert reply.headers["content-type"] == TYPES[os.path.splitext(path)[1]], (path, reply.headers)
            assert reply.headers["etag"] == f'"{hashlib.sha256(content).hexdigest()[:32]}"', (path, reply.headers)
            assert policy(reply) == DIRECTIVES and reply.headers["x-content-type-options"] == "nosniff", (path, reply.headers)
            same = daemon.get(f"/web/{path}", headers={"If-None-Match": reply.headers["etag"]})
            # What a 304 tells replaces what a cache has: another policy would disarm the page when it is loaded again.
            assert same.status == 304 and same.body == b"" and policy(same) == DIRECTIVES, (path, same.headers)
            head = daemon.request("HEAD", f"/web/{path}")
            assert head.status == 200 and head.body == b"" and int(head.headers["content-length"]) == len(content), (path, head.headers)
            assert "Accept-Encoding" in same.headers["vary"], same.headers
            packed = daemon.get(f"/web/{path}", headers={"Accept-Encoding": "gzip"})
            if packed.headers.get("content-encoding") == "gzip":
                assert gzip.decompress(packed.body) == content and len(packed.body) < len(content), path
            else:
                assert len(content) < 1024, (path, packed.headers)
        for path in ("", "none.js", "js", "js/", "js/none.js", "js/main.js/x", "vendor/SHA256SUMS/x", "..%2fREADME.md", "js%2fmain.js",
                     "js/..%2findex.html"):
            assert daemon.get(f"/web/{path}").status in (400, 404), path


def test_browsers_get_the_page_and_shells_their_lines():
    """/ is the dashboard for whoever prefers HTML, the curl lines for all others; both say that they vary."""
    with program.daemon() as daemon:
        page = daemon.get("/", headers={"Accept": "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"})
        assert page.body.decode() == text("index.html") and policy(page) == DIRECTIVES, page.headers
        assert page.headers["content-type"] == TYPES[".html"], page.headers
        assert page.headers["vary"] in ("Accept", "Accept, Accept-Encoding"), page.headers
        same = daemon.get("/", headers={"Accept": "text/html", "If-None-Match": page.headers["etag"]})
        assert same.status == 304 and policy(same) == DIRECTIVES, same.headers
        for accept in ("*/*", "text/plain", None):
            lines = daemon.get("/", headers={"Accept": accept} if accept else {})
            assert lines.headers["content-type"] == "text/plain; charset=utf-8" and b"curl" in lines.body, lines


def test_every_link_of_the_page_works_under_a_base_url():
    """The page's links are relative: under https://host/impactd they lead to /impactd/..., and so do the modules' imports."""
    with program.daemon("--base-url", "http://127.0.0.1/impactd") as daemon:
        page = daemon.get("/impactd/", headers={"Accept": "text/html"})
        links = [link for link in re.findall(r'(?:href|src)="([^"]+)"', page.body.decode()) if not link.startswith("#")]
        assert len(links) > 5 and not any(link.startswith("/") for link in links), links
        for link in links:
            assert daemon.get(f"/impactd/{link}").status == 200, link


if __name__ == "__main__":
    program.main(globals())
