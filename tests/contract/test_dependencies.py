#!/usr/bin/env python3
"""Files of core/ and of server/ depend on each other without cycles and only downward; static functions have names of
their own.

A file depends on the files that it includes and on the files that define the symbols its object file uses. A header and
the source of the same name are one file. core/README.md says which folders each folder may use. Needs a finished build.
In server/ the order of folders is that of test_includes.py, without exceptions. `--update` rewrites the list of
exceptions in this file from the present state of core/ and prints what changed."""

import collections
import os
import re
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from test_includes import FLOORS, sources, without_comments  # noqa: E402

README = os.path.join(program.SOURCE, "core", "README.md")
STATIC_NAME_MAX = 2  # files of core/ in which one name of a static function may be defined

# Known exceptions. The list shrinks: an exception that is not needed any more fails the test, as a new violation does.
# cycle: dependencies without which core/ has no cycle; upward: between folders; static: names in too many files.
# exceptions: begin
EXCEPTIONS = {
    "cycle": [
    ],
    "upward": [
    ],
    "static": [
    ],
}
# exceptions: end


def folders_of_readme():
    """{folder of core/: folders that it may use}, as the table in core/README.md says."""
    with open(README, encoding="utf-8") as file:
        rows = re.findall(r"^\| (\w+) \| [^|]+ \|([\w, ]*)\|$", file.read(), re.M)
    return {folder: re.findall(r"\w+", uses) for folder, uses in rows if folder != "folder"}


CORE = folders_of_readme()


def node(path):
    """The file as dependencies count it: core/plan/plan of core/plan/plan.c and core/plan/plan.h."""
    return os.path.splitext(path)[0]


def dependencies(texts, objects):
    """{(file, file it depends on): where} of {path: text} and {path: (symbols defined, symbols used)}."""
    edges = {}
    for path, text in sorted(texts.items()):
        for number, line in enumerate(without_comments(text, True).splitlines(), 1):
            include = re.match(r'\s*#\s*include\s*"([^"]+)"', line)
            if include and node(include[1]) != node(path):
                edges.setdefault((node(path), node(include[1])), f"{path}:{number} includes {include[1]}")
    definer = {symbol: path for path, (defined, _) in objects.items() for symbol in defined}
    for path, (_, used) in sorted(objects.items()):
        for symbol in sorted(used & definer.keys()):
            if node(definer[symbol]) != node(path):
                edges.setdefault((node(path), node(definer[symbol])), f"{path} uses {symbol} of {definer[symbol]}")
    return edges


def cycles(edges):
    """The cycles: sets of more than one file of which each depends on all others. (Tarjan's algorithm)"""
    after = collections.defaultdict(list)
    for start, end in sorted(edges):
        after[start].append(end)
    index, low, stack, found = {}, {}, [], []

    def visit(one):
        index[one] = low[one] = len(index)
        stack.append(one)
        for other in after[one]:
            if other not in index:
                visit(other)
            if other in stack:
                low[one] = min(low[one], low[other])
        if low[one] == index[one]:
            cut = stack.index(one)
            if len(stack) > cut + 1:
                found.append(set(stack[cut:]))
            del stack[cut:]

    for one in sorted({file for edge in edges for file in edge}):
        if one not in index:
            visit(one)
    return sorted(found, key=lambda cycle: (-len(cycle), sorted(cycle)))


def cycle_cut(edges, preferred=()):
    """A small set of dependencies without which there is no cycle; those of `preferred` if they will do."""
    cut = {edge for edge in preferred if edge in edges}
    for cycle in cycles(edges.keys() - cut):
        inner = [edge for edge in edges.keys() - cut if cycle.issuperset(edge)]
        # An order with few dependencies backward: the file with most dependencies over dependents comes first.
        left, order = set(cycle), {}
        while left:
            weight = collections.Counter({file: 0 for file in left})
            for start, end in inner:
                if start in left and end in left:
                    weight[start] += 1
                    weight[end] -= 1
            first = min(left, key=lambda file: (-weight[file], file))
            order[first] = len(order)
            left.remove(first)
        cut |= {(start, end) for start, end in inner if order[start] > order[end]}
    for edge in sorted(cut):
        if not cycles((edges.keys() - cut) | {edge}):
            cut.remove(edge)
    return cut


def upward(edges):
    """The dependencies between folders of core/ that CORE does not allow."""
    def folder(file):
        return file.split("/")[1]
    return {edge for edge in edges
            if folder(edge[0]) != folder(edge[1]) and folder(edge[1]) not in CORE.get(folder(edge[0]), [])}


def static_names(texts):
    """{name of a static function: the sources that define it}."""
    names = collections.defaultdict(set)
    for path, text in texts.items():
        if path.endswith(".c"):
            for found in re.finditer(r"^(?:static|INLINE)\s(?:\s*__attribute__\(\([^()]*(?:\([^()]*\))?\)\))*[\w\s*]*?"
                                     r"[\s*](\w+)\s*\(", without_comments(text, False), re.M):
                names[found[1]].add(path)
    return names


def text_of(edge):
    return f"{edge[0]} > {edge[1]}"


def violations(texts, objects):
    """{kind: {exception that would allow it: message}}, the cycles by the smallest cut found, and the cycles."""
    edges = dependencies(texts, objects)
    listed = [tuple(line.split(" > ")) for line in EXCEPTIONS["cycle"]]
    return {
        "cycle": {text_of(edge): "closes a cycle: " + edges[edge] for edge in cycle_cut(edges, listed)},
        "upward": {text_of(edge): "points upward: " + edges[edge] for edge in upward(edges)},
        "static": {name: "static in " + ", ".join(sorted(files)) for name, files in static_names(texts).items()
                   if len(files) > STATIC_NAME_MAX},
    }, cycles(edges)


def faults(found, exceptions):
    """One line for each violation that is no exception, and for each exception that is no violation."""
    for kind, messages in found.items():
        for key in sorted(messages.keys() - set(exceptions[kind])):
            yield f"{kind}: {key}: {messages[key]}"
        for key in sorted(set(exceptions[kind]) - messages.keys()):
            yield f"{kind}: {key}: is listed as an exception and needs none; run this test with --update"


def object_symbols(half, texts):
    """{source: (symbols defined, symbols used)} of the objects that the build made of the sources of `half`."""
    folder = os.path.join(program.build, "CMakeFiles", f"impactd_{half}.dir")
    objects = {path: os.path.join(folder, path + ".o") for path in texts
               if os.path.isfile(os.path.join(folder, path + ".o"))}
    if not objects:
        return {}
    listing = subprocess.run(["nm", "-A", "-P", *objects.values()], capture_output=True, text=True, check=True).stdout
    symbols = {path: (set(), set()) for path in objects}
    for line in listing.splitlines():
        file, name, kind = line.split()[:3]
        path = os.path.relpath(file.rstrip(":"), folder)[:-len(".o")]
        if kind in "Uwv":
            symbols[path][1].add(name)
        elif kind.isupper():
            symbols[path][0].add(name)
    return symbols


def half_of(half):
    texts = {path: text for path, text in sources() if path.startswith(half + "/")}
    return texts, object_symbols(half, texts)


def figures(half, found, circles):
    return (f"{half}: {len(circles)} cycles, the largest of {max(map(len, circles), default=0)} files, cut by "
            f"{len(found['cycle'])} dependencies; {len(found['upward'])} dependencies upward; "
            f"{len(found['static'])} names of static functions in more than {STATIC_NAME_MAX} files")


def test_core_depends_downward():
    """In core/ nothing is in a cycle, depends upward or shares a static name, but for the listed exceptions."""
    texts, objects = half_of("core")
    missing = sorted(path for path in texts if path.endswith(".c") and path not in objects)
    assert len(objects) > 30 and not missing, f"not built: {missing}"
    found, circles = violations(texts, objects)
    print(figures("core", found, circles))
    wrong = list(faults(found, EXCEPTIONS))
    assert not wrong, "\n" + "\n".join(wrong)


def test_readme_names_what_exists():
    """Every folder, file, function and type that core/README.md names exists, and it lists every folder."""
    folders = {path.split("/")[1] for path, _ in sources() if path.startswith("core/")}
    assert folders == CORE.keys(), folders ^ CORE.keys()
    with open(README, encoding="utf-8") as file:
        text = file.read()
    words = set(re.findall(r"\w+", " ".join(text for path, text in sources() if path.startswith("core/"))))
    for name in re.findall(r"`([^`\n]+)`", text):
        if "NAME" in name:
            continue
        if "/" in name or name.endswith(".c"):
            known = any(os.path.exists(os.path.join(program.SOURCE, top, name)) for top in (
                "", "core", *(os.path.join("core", folder) for folder in folders)))
        elif re.fullmatch(r"[\w.]*[A-Z_.][\w.]*", name):
            known = words.issuperset(name.split("."))
        else:
            continue
        assert known, f"`{name}` does not exist"


def test_server_depends_downward():
    """In server/ nothing is in a cycle, depends upward or shares a static name."""
    texts, objects = half_of("server")
    edges = {edge: where for edge, where in dependencies(texts, objects).items() if edge[1].startswith("server/")}
    height = {name: at for at, name in enumerate(name for floor in FLOORS["server"] for name in floor)}
    over = [edge for edge in edges if height[edge[0].split("/")[1]] < height[edge[1].split("/")[1]]]
    names = [name for name, files in static_names(texts).items() if len(files) > STATIC_NAME_MAX]
    cut = cycle_cut(edges)
    print(figures("server", {"cycle": cut, "upward": over, "static": names}, cycles(edges)))
    wrong = [f"{text_of(edge)} {why}: {edges[edge]}" for why, found in (("closes a cycle", cut), ("points upward", over))
             for edge in sorted(found)] + [f"{name} is static in more than {STATIC_NAME_MAX} files" for name in names]
    assert objects and not wrong, "\n" + "\n".join(wrong)


def test_planted_violations_are_found():
    """Planted cycles, upward dependencies, shared names and stale exceptions are found, and nothing else."""
    def planted(texts, objects=None, exceptions=None):
        used = {path: (set(defined.split()), set(used.split())) for path, (defined, used) in (objects or {}).items()}
        return list(faults(violations(texts, used)[0], {"cycle": [], "upward": [], "static": [], **(exceptions or {})}))

    def include(*files):
        return "".join(f'#include "{file}.h"\n' for file in files)

    a, b, c = "core/plan/a", "core/plan/b", "core/plan/c"
    innocent = {a + ".c": include(a, b) + '// #include "core/study/x.h"\nstatic int one(void) {}\n',
                a + ".h": include("core/base/x"), b + ".h": "", b + ".c": include(b) + "static int one(int);\n"}
    assert not planted(innocent), planted(innocent)
    # By includes, by symbols, by both, and by way of a third file.
    for texts, objects in (
            ({a + ".h": include(b), b + ".c": include(a)}, {}),
            ({a + ".c": "", b + ".c": ""}, {a + ".c": ("a_run", "b_run"), b + ".c": ("b_run", "a_run memcpy")}),
            ({a + ".c": include(b), b + ".c": ""}, {a + ".c": ("a_run", ""), b + ".c": ("", "a_run")}),
            ({a + ".c": include(b), b + ".inc": include(c), c + ".c": include(a)}, {})):
        found = planted(texts, objects)
        assert len(found) == 1 and found[0].startswith("cycle: "), found
        exception = found[0].split(": ")[1]
        assert not planted(texts, objects, {"cycle": [exception]})
        assert "needs none" in planted(innocent, None, {"cycle": [exception]})[0]
    # Two cycles need two exceptions; one exception for each cycle in common is enough.
    assert len(planted({a + ".h": include(b, c), b + ".h": include(a), c + ".h": include(a)})) == 2
    assert len(planted({a + ".h": include(b), b + ".h": include(a, c), c + ".h": include(b)})) == 2
    assert len(planted({a + ".h": include(b), b + ".h": include(a, c), c + ".h": include(a)})) == 1
    for lower, upper in (("core/base/x.c", "core/math/y.c"), ("core/contact/x.c", "core/excitation/y.c"),
                         ("core/scene/x.c", "core/plan/y.c"), ("core/drop_test/x.c", "core/plan/y.c"),
                         ("core/formats/x.c", "core/math/y.c"), ("core/study/x.c", "core/drop_test/y.c")):
        by_symbol = planted({lower: "", upper: ""}, {lower: ("", "y_run"), upper: ("y_run", "")})
        by_include = planted({lower: include(node(upper))})
        for found in (by_symbol, by_include):
            assert len(found) == 1 and found[0].startswith(f"upward: {node(lower)} > {node(upper)}: "), found
    for upper, lower in (("core/study/x.c", "core/base/y.c"), ("core/drop_test/x.c", "core/scene/y.c"),
                         ("core/plan/x.c", "core/excitation/y.c"), ("core/plan/x.c", "core/plan/y.c")):
        assert not planted({upper: include(node(lower))})
    common = {f"core/plan/{name}.c": f"{start} run(int a) {{ }}\n" for name, start in (
        ("a", "static const double *"), ("b", "static inline struct X\n"), ("c", "INLINE __attribute__((cold)) bool"))}
    assert [line.split(":")[:2] for line in planted(common)] == [["static", " run"]], planted(common)
    assert not planted(common, None, {"static": ["run"]})
    assert not planted(dict(list(common.items())[:2]))
    others = {f"core/plan/{name}.c": "static double (*pick)(int);\nstatic const int x[] = {F(1)};\nint run(void);\n"
              for name in "abc"}
    assert not planted(others), planted(others)


def update():
    """Rewrites the exceptions from the present state of core/."""
    found, circles = violations(*half_of("core"))
    with open(__file__, encoding="utf-8") as file:
        text = file.read()
    lines = ["EXCEPTIONS = {"]
    for kind, keys in found.items():
        lines += [f'    "{kind}": ['] + [f'        "{key}",' for key in sorted(keys)] + ["    ],"]
    block = "# exceptions: begin\n" + "\n".join(lines + ["}"]) + "\n# exceptions: end\n"
    with open(__file__, "w", encoding="utf-8") as file:
        file.write(re.sub(r"# exceptions: begin\n.*?# exceptions: end\n", lambda _: block, text, count=1, flags=re.S))
    for line in faults(found, EXCEPTIONS):
        print("-" if "needs none" in line else "+", line.split("; run")[0])
    print(figures("core", found, circles))


if __name__ == "__main__":
    if "--update" in sys.argv:
        sys.argv.remove("--update")
        if "--build" in sys.argv:
            program.build = os.path.abspath(sys.argv[sys.argv.index("--build") + 1])
        update()
    else:
        program.main(globals())
