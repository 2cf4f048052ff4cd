#!/usr/bin/env python3
"""Every code block of README.md and web/guide/*.md runs as printed.

Each page has a daemon and a temporary folder of its own. The folder holds scene.json, the paper's free
sponge. The blocks of a page run in their order, and each language keeps its variables from block to block,
as a terminal does. The words after the opening ``` say what a block is:

    sh, console    bash runs it (of console: the lines after "$ "); a command that fails fails the page
    python, octave Debian's python3 and octave-cli run it
    json           a scene or a study (the daemon validates it), or another body of a request (its schema)
    json fragment  members of a document; must be JSON, with "..." anywhere it is only shown
    text output    the output of the block before; "..." or an ellipsis stands for any text
    text terminal  the output of the last impactd command of the block before, on a terminal of 80 columns;
                   the time that it took may differ, and a line of "..." stands for any lines
    LANGUAGE NAME  a word with a dot, such as tower.json: the block is also saved as this file
    LANGUAGE PATH  a word with a slash and a dot: an excerpt of this source file; lines of "..." leave lines out
    ... not-run    shown only; a reason may follow. Other languages and `text` are shown only, too

http://127.0.0.1:8080 and localhost:8080 become the address of the page's daemon; IMPACTD_SERVER is that
address and impactd is on PATH. `test_recipes.py scripting` runs one page. With UPDATE_TERMINALS=1 blocks `text
terminal` are rewritten instead of compared."""

import glob
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading

import jsonschema

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

MAX_SECONDS = 60  # of one block
PAGES = ["README.md", *sorted(os.path.relpath(path, program.SOURCE)
                              for path in glob.glob(os.path.join(program.SOURCE, "web", "guide", "*.md")))]
# Bodies of requests that are not scenes.
SCHEMAS = ["new_material", "material_revision", "material_revert", "material_review", "measurement"]
DONE = "--block-done--"
# Reads the names of files with a block from standard input and runs each in one namespace.
PYTHON = f"""
import sys
sys.path.insert(0, "")
names = {{"__name__": "__main__"}}
for path in iter(sys.stdin.readline, ""):
    with open(path.strip()) as file:
        exec(compile(file.read(), path.strip(), "exec"), names)
    print("{DONE}", flush=True)
"""
# Command of an interpreter, and the line that makes it run a file and report the end.
INTERPRETERS = {
    "sh": (["bash", "-c", f"""set -Eeuo pipefail; exec 3<&0
trap 'echo "line $LINENO: $BASH_COMMAND: exit code $?"' ERR
while read -r path <&3; do . "$path" </dev/null; echo "{DONE}"; done"""], "{0}\n"),
    "python": (["/usr/bin/python3", "-c", PYTHON], "{0}\n"),
    "octave": (["octave-cli", "--no-init-file", "--quiet"], f"source('{{0}}'); printf('{DONE}\\n'); fflush(stdout);\n"),
}
INTERPRETERS["console"] = INTERPRETERS["sh"]


class Block:
    """A fenced code block: its language, the words after it, its text and the line where the text begins."""

    def __init__(self, info, text, line):
        self.language, *self.words = info.split() or [""]
        self.text, self.line = text, line
        self.is_run = not any(word.startswith("not-run") for word in self.words)
        self.file = next((word for word in self.words if re.fullmatch(r"[\w-]+(\.\w+)+", word)), None)
        self.source = next((word for word in self.words if re.fullmatch(r"[\w/-]+/[\w-]+(\.\w+)+", word)), None)


def blocks(path):
    """All fenced blocks of a page."""
    found, opened = [], None
    with open(os.path.join(program.SOURCE, path), encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            fence = re.match(r"( *)(`{3,})(.*)$", line)
            if opened is None and fence:
                opened = (fence[2], fence[3].strip(), number + 1, [], len(fence[1]))
            elif opened and fence and fence[2] == opened[0] and not fence[3].strip():
                found.append(Block(opened[1], "".join(opened[3]), opened[2]))
                opened = None
            elif opened:
                opened[3].append(re.sub(f"^ {{0,{opened[4]}}}", "", line))
    assert opened is None, f"{path}:{opened[2]}: the block is not closed"
    return found


def hidden_commands(path):
    """Lines of indented blocks that look like commands: no test would run them."""
    with open(os.path.join(program.SOURCE, path), encoding="utf-8") as file:
        text = re.sub(r"^```.*?^```$", lambda whole: "\n" * whole[0].count("\n"), file.read(), flags=re.M | re.S)
    return [number for number, line in enumerate(text.split("\n"), 1)
            if re.match(r"(?: {4,}|\t)(?:\$ )?(?:curl|impactd|systemctl|sudo|apt|cmake|[\w./]+\.sh) ", line)]


def commands(block):
    """What bash runs of a block of sh or console, line by line as on the page."""
    if block.language != "console":
        return block.text
    kept, is_command = [], False
    for line in block.text.split("\n"):
        if line.startswith("$ ") or (is_command and line.startswith("> ")):
            kept.append(line[2:])
            is_command = True
        else:
            kept.append("")
            is_command = False
    return "\n".join(kept)


class Page:
    """A page's folder, daemon and interpreters while its blocks run."""

    def __init__(self, path, daemon, folder):
        self.path, self.daemon, self.folder = path, daemon, folder
        self.interpreters = {}
        self.output = ""  # of the last block that ran
        self.last = None  # that block
        self.environment = {**os.environ, "IMPACTD_SERVER": daemon.url, "HOME": folder, "XDG_STATE_HOME": folder,
                            "PATH": program.build + os.pathsep + os.environ["PATH"], "MPLBACKEND": "Agg", "LC_ALL": "C.UTF-8"}
        self.environment.pop("IMPACTD_TOKEN", None)
        shutil.copy(os.path.join(program.EXAMPLES, "paper_free_sponge.json"), os.path.join(folder, "scene.json"))

    def here(self, text):
        """The text with the address of this page's daemon."""
        return re.sub(r"(127\.0\.0\.1|localhost):8080", rf"\1:{self.daemon.port}", text)

    def interpreter(self, language):
        command, ask = INTERPRETERS[language]
        key = command[0]
        if key not in self.interpreters:
            if shutil.which(key) is None:
                raise program.Skipped(f"{key} is not here")
            self.interpreters[key] = subprocess.Popen(command, cwd=self.folder, env=self.environment, text=True, stdin=subprocess.PIPE,
                                                      stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
        return self.interpreters[key], ask

    def run(self, block):
        """Runs a block; the reason of its failure, or None."""
        process, ask = self.interpreter(block.language)
        name = f"{os.path.basename(self.path)}.{block.language}"
        with open(os.path.join(self.folder, name), "w", encoding="utf-8") as file:
            file.write("\n" * (block.line - 1) + self.here(commands(block)))
        timer = threading.Timer(MAX_SECONDS, os.killpg, (process.pid, signal.SIGKILL))
        timer.start()
        try:
            process.stdin.write(ask.format(name))
            process.stdin.flush()
            lines = []
            for line in process.stdout:
                if line.rstrip("\n").endswith(DONE):
                    self.output = "".join(lines) + line.rstrip("\n")[:-len(DONE)]
                    return None
                lines.append(line)
        finally:
            timer.cancel()
        code = process.wait()
        if code == -signal.SIGKILL:
            return f"takes more than {MAX_SECONDS} s"
        return f"exit code {code}:\n" + "".join(lines[-30:])

    def validate(self, block):
        """What is wrong with a block of JSON, or None."""
        try:
            if "fragment" in block.words:
                if "..." in block.text or "…" in block.text:
                    return None
                text = block.text.strip().rstrip(",")
                json.loads(text if text[0] in "[{" else "{" + text + "}")
                return None
            document = json.loads(block.text)
        except ValueError as error:
            return f"not JSON: {error}"
        if "structure" in document:
            reply = self.daemon.request("POST", "/v1/jobs?dry_run=1", json=document)
            return None if reply.status == 200 else json.dumps(reply.json(), indent=1)
        faults = []
        for name in SCHEMAS:
            with open(os.path.join(program.SOURCE, "schema", name + ".schema.json"), encoding="utf-8") as file:
                try:
                    jsonschema.validate(document, json.load(file))
                    return None
                except jsonschema.ValidationError as error:
                    faults.append(f"{name}: {error.message}")
        return "neither a scene nor another body (a part of a document is a `json fragment`):\n" + "\n".join(faults)

    def terminal(self):
        """What the last impactd command of the block before prints on a terminal of 80 columns."""
        lines = commands(self.last).replace("\\\n", " ").split("\n")
        command = [line for line in lines if line.startswith("impactd ")][-1]
        run = subprocess.run(["script", "-qec", f"stty cols 80; {self.here(command)} 2>/dev/null", "/dev/null"], cwd=self.folder,
                             env={**self.environment, "TERM": "xterm", "NO_COLOR": "1"}, stdout=subprocess.PIPE, timeout=MAX_SECONDS,
                             check=True)
        return run.stdout.decode().replace("\r\n", "\n")

    def compare_terminal(self, block):
        """How the terminal differs from a block that shows it, or None."""
        output = re.sub(r"[ \t]+$", "", self.terminal().strip("\n"), flags=re.M) + "\n"
        shown, printed = (re.sub(r"\bin\s+[\d.]+\s+[mu]?s\b", "", text) for text in (block.text, output))
        parts = [" ".join(part.split()) for part in re.split(r"^\.\.\.$", shown, flags=re.M)]
        if re.fullmatch(".*".join(re.escape(part) for part in parts), " ".join(printed.split())):
            return None
        if os.environ.get("UPDATE_TERMINALS") and len(parts) == 1:
            block.text = output
            return None
        return f"the terminal does not show this but:\n{output}"

    def compare(self, block):
        """How the output differs from a block of expected output, or None."""
        if self.output is None:
            return "the block before was not run"
        parts = re.split(r"\.\.\.|…", self.here(block.text).strip())
        if re.fullmatch(".*?".join(re.escape(part) for part in parts), self.output.strip(), re.S):
            return None
        return f"the output is not the printed one but:\n{self.output}"

    @staticmethod
    def quote(block):
        """What of an excerpt is not in its source file, or None."""
        with open(os.path.join(program.SOURCE, block.source), encoding="utf-8") as file:
            rest = file.read()
        for part in re.split(r"^ *\.\.\.\n", block.text, flags=re.M):
            before, found, rest = rest.partition(part)
            if not found:
                return f"not in {block.source}:\n{part}"
        return None

    def block(self, block):
        """What is wrong with a block, or None."""
        if block.source:
            return self.quote(block)
        if block.file:
            with open(os.path.join(self.folder, block.file), "w", encoding="utf-8") as file:
                file.write(block.text)
        if not block.is_run:
            self.output = None
            return None
        if block.language in INTERPRETERS:
            self.last = block
            return self.run(block)
        if block.language == "json":
            return self.validate(block)
        if block.language == "text" and "output" in block.words:
            return self.compare(block)
        if block.language == "text" and "terminal" in block.words:
            return self.compare_terminal(block)
        return None

    def close(self):
        for process in self.interpreters.values():
            process.stdin.close()
            try:
                process.wait(10)
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
                process.stdout.close()


def check(path):
    """Runs a page; the first block that fails ends it, for those after it may need what it makes."""
    hidden = [] if path == "README.md" else hidden_commands(path)
    assert not hidden, f"{path}:{hidden[0]}: commands belong in a ```sh block"
    found = blocks(path)
    if not any(block.source or (block.is_run and block.language in (*INTERPRETERS, "json", "text")) for block in found):
        return
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        page = Page(path, daemon, folder)
        try:
            for block in found:
                fault = page.block(block)
                assert fault is None, f"{path}:{block.line}: ```{block.language} {fault}"
        finally:
            page.close()
    if os.environ.get("UPDATE_TERMINALS"):
        update_terminals(path, found)


def update_terminals(path, found):
    """Writes the texts of blocks `text terminal` into the page."""
    path = os.path.join(program.SOURCE, path)
    with open(path, encoding="utf-8") as file:
        lines = file.read().split("\n")
    for block in reversed([block for block in found if block.language == "text" and "terminal" in block.words]):
        lines[block.line - 1:lines.index("```", block.line - 1)] = block.text.split("\n")[:-1]
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


def page_test(path):
    def test():
        check(path)
    test.__doc__ = f"{path} runs as printed"
    return test


for one in PAGES:
    globals()["test_" + os.path.basename(one)] = page_test(one)


def slugs(path):
    """The anchors of a page's headings, as GitHub makes them."""
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"^ *```.*?^ *```$", "", file.read(), flags=re.M | re.S)
    return {re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-") for title in re.findall(r"^#+ (.*)$", text, re.M)}


def test_links_of_the_readme():
    """Every relative link of README.md leads to a file, and to a heading of it; those of the guide are checked by the build."""
    with open(os.path.join(program.SOURCE, "README.md"), encoding="utf-8") as file:
        links = re.findall(r"\]\(([^)\s]+)\)", re.sub(r"^```.*?^```$", "", file.read(), flags=re.M | re.S))
    for link in links:
        if "://" in link:
            continue
        path, _, anchor = link.partition("#")
        path = os.path.join(program.SOURCE, path or "README.md")
        assert os.path.isfile(path), link
        assert not anchor or anchor in slugs(path), link
    assert len(links) > 10, links


def test_a_fault_is_found_at_its_line():
    """A block that fails, hangs, prints something else or is no scene is reported with its line."""
    global MAX_SECONDS
    pages = {"```sh\ntrue\nfalse | cat\n```\n": ":2: ```sh exit code 1:\nline 3: cat: exit code 1",
             "```sh\nsleep 9\n```\n": ":2: ```sh takes more than 0.5 s",
             "```python\nx = 1\n```\n\n```python\nassert x == 2\n```\n": ', line 6, in <module>',
             "```octave\nx = 1;\n```\n```octave\nassert(x == 2)\n```\n": ":5: ```octave exit code 1",
             "```console\n$ echo one\nthree\n```\n```text output\n...two\n```\n": "the output is not the printed one but:\none",
             "```sh\nimpactd version\n```\n```text terminal\nimpactd 0\n```\n": "the terminal does not show this but:\nimpactd 0.",
             '```json\n{"structure": {"mass": -1}}\n```\n': "must be above 0 kg",
             '```json\n{"slug": "a", "colour": 1}\n```\n': "neither a scene nor another body",
             '```json fragment\n"a": 1, b\n```\n': "not JSON",
             "```c core/contact/contacts.c\n    &contact_auto,\n    ...\n    &contact_new,\n```\n": "not in core/contact/contacts.c:\n    &contact_new",
             "A line\n\n    impactd run scene.json\n": "commands belong in"}
    with tempfile.TemporaryDirectory() as folder:
        for text, fault in pages.items():
            path = os.path.join(folder, "page.md")
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            usual, MAX_SECONDS = MAX_SECONDS, 0.5 if "sleep" in text else MAX_SECONDS
            try:
                check(path)
            except AssertionError as error:
                assert fault in str(error), (text, str(error))
            else:
                raise AssertionError(("no fault", text))
            finally:
                MAX_SECONDS = usual


if __name__ == "__main__":
    program.main(globals())
