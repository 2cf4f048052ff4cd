#!/usr/bin/env python3
"""The guide as it is served: pages, links, anchors, pictures and search; its links from the dashboard, README.md and problem
documents; its generated parts; and that the build refuses faults in pages."""

import html.parser
import json
import os
import posixpath
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

BASE = "/impactd"


def read(*path):
    with open(os.path.join(program.SOURCE, *path), encoding="utf-8") as file:
        return file.read()


def pages():
    """The pages in their order."""
    return [line for line in read("web", "guide", "pages.txt").splitlines() if line and not line.startswith("#")]


def anchors(text):
    """GitHub's anchors of the headings of a Markdown text; code is left out."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.S | re.M)
    headings = [re.sub(r"[`*]|\[([^]]*)\]\([^)]*\)", r"\1", heading) for heading in re.findall(r"^#+ (.*)$", text, re.M)]
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings}


class Page(html.parser.HTMLParser):
    """The ids, links and pictures of a page."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.pictures = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.ids += [found["id"]] if "id" in found else []
        self.links += [found[name] for name in ("href", "src") if name in found]
        self.pictures += [found] if tag == "img" else []
        assert tag != "script" or "src" in found, "an inline script"
        assert not any(name == "style" or name.startswith("on") for name in found), (tag, found)


def test_every_link_and_anchor_of_every_page_leads_somewhere():
    """Of all pages, below a base URL: links are relative, each is answered 200, each anchor is an id there; pictures have a text."""
    with program.daemon("--base-url", f"http://127.0.0.1{BASE}") as daemon:
        served = {name: Page(daemon.get(f"{BASE}/guide/{name}.html").body.decode()) for name in pages()}
        assert daemon.get(f"{BASE}/guide/").body == daemon.get(f"{BASE}/guide/index.html").body
        assert daemon.get(f"{BASE}/guide").headers["location"] == f"{BASE}/guide/"
        asked = {}
        for name, page in served.items():
            assert len(page.ids) == len(set(page.ids)), (name, [one for one in page.ids if page.ids.count(one) > 1])
            assert all(picture["alt"] or picture["src"].endswith("icon.svg") for picture in page.pictures), name
            for link in page.links:
                if re.match(r"(https?|mailto):", link):
                    continue
                target, _, anchor = link.partition("#")
                path = posixpath.normpath(posixpath.join(f"{BASE}/guide/", target)) + ("/" if target in ("./", "../") else "")
                if target and path not in asked:
                    asked[path] = daemon.get(path).status
                assert not target or asked[path] == 200, (name, link)
                other = page if not target else served.get("index" if target == "./" else target.removesuffix(".html"))
                assert not anchor or anchor.startswith("/") or other is None or anchor in other.ids, (name, link)
        assert len(asked) > len(served), asked


def test_pages_are_served_as_the_dashboard_is():
    """Type, entity tag (304), the strict policy, HEAD; unknown names are 404, other methods 405."""
    with program.daemon() as daemon:
        page = daemon.get("/guide/problems.html")
        dashboard = daemon.get("/", headers={"Accept": "text/html"})
        for name in ("content-type", "content-security-policy", "cache-control", "x-content-type-options", "referrer-policy"):
            assert page.headers.get(name) == dashboard.headers.get(name), (name, page.headers)
        same = daemon.get("/guide/problems.html", headers={"If-None-Match": page.headers["etag"]})
        assert same.status == 304 and same.body == b"", same
        assert daemon.request("HEAD", "/guide/problems.html").headers["content-length"] == str(len(page.body))
        for path in ("none.html", "problems", "problems.md", "guide.html", "pages.txt", "x/problems.html", "..%2fweb%2findex.html"):
            assert daemon.get(f"/guide/{path}").status == 404, path
        assert daemon.request("POST", "/guide/problems.html").status == 405


def test_every_type_of_problem_has_its_section():
    """GET of a problem's type redirects to a section of the guide; no section is of another type."""
    types = set(re.findall(r'X\(\w+, "([\w-]+)", ', read("core", "base", "status.h"))) - {"ok"}
    sections = set(re.findall(r"^## ([\w-]+)$", read("web", "guide", "problems.md"), re.M))
    assert types == sections and len(types) > 20, types ^ sections
    with program.daemon() as daemon:
        ids = Page(daemon.get("/guide/problems.html").body.decode()).ids
        for name in types:
            reply = daemon.get(f"/problems/{name}")
            assert reply.status == 303 and reply.headers["location"] == f"/guide/problems.html#{name}", (name, reply)
            assert name in ids, name
        for path in ("/problems/none", "/problems/ok"):
            assert daemon.get(path).status == 404, path
        kind = daemon.get("/v1/jobs/j-00000000").json()["type"]
        assert daemon.get(kind).status == 303, kind


def test_the_guides_module_finds_what_it_imports():
    """Every module that guide.js imports is there."""
    names = re.findall(r'^import .* from "(.*)";$', read("web", "guide", "guide.js"), re.M)
    assert len(names) > 2, names
    for name in names:
        path = os.path.normpath(os.path.join(program.SOURCE, "guide", name))  # as it is served
        assert os.path.exists(path), path


def test_every_question_mark_of_the_dashboard_leads_to_a_section():
    """The places of js/help.js and the pages of studies exist, and the header of the dashboard has the guide."""
    places = re.findall(r'"?: "([\w-]+)(?:#([\w-]+))?"', read("web", "js", "help.js"))
    kinds = re.findall(r"^  (\w+): \{", re.search(r"const KINDS = \{(.*?)\n\};", read("web", "js", "study", "kinds.js"), re.S)[1], re.M)
    assert len(kinds) == 9, kinds
    places += [(f"study-{kind}", "") for kind in kinds]
    for folder, _, files in os.walk(os.path.join(program.SOURCE, "web", "js")):
        for file in files:
            places += re.findall(r'"([a-z-]+)#([a-z-]+)"', read(folder, file))
    assert len(places) > 38, places
    with program.daemon() as daemon:
        served = {name: Page(daemon.get(f"/guide/{name}.html").body.decode()).ids for name in pages()}
    for name, anchor in places:
        assert name in served and (not anchor or anchor in served[name]), (name, anchor)
    assert '<a href="guide/">Guide</a>' in read("web", "index.html")


def test_pages_for_people_ignore_queries_and_wrong_addresses_lead_on():
    """Links with a query of others work; a browser gets the guide's first page at a wrong address, other clients the problem."""
    browser = {"Accept": "text/html,*/*;q=0.8"}
    with program.daemon() as daemon:
        for path in ("/guide/", "/guide/concepts.html", "/client/impactd.py", "/client", "/web/style.css", "/"):
            assert daemon.get(path + "?utm_source=a&x=1", headers=browser).status == 200, path
        assert daemon.get("/v1/jobs?utm_source=a").status == 400
        page = daemon.get("/guide/nothing.html", headers=browser)
        assert page.status == 404 and page.body == daemon.get("/guide/").body and page.headers["content-type"].startswith("text/html"), page
        assert daemon.get("/guide/nothing.html").json()["type"] == "/problems/not-found"


def test_links_of_readme_lead_somewhere():
    """Files, folders, pictures and anchors, here and in pages of the guide; likewise links of the guide to files of the sources."""
    for source in ["README.md", *(f"web/guide/{name}.md" for name in pages())]:
        text = re.sub(r"^```.*?^```", "", read(source), flags=re.S | re.M)
        for link in re.findall(r"\]\(([^)\s]+)\)", text):
            if re.match(r"(https?|mailto):", link) or source != "README.md" and not link.startswith("../../"):
                continue
            path, _, anchor = link.partition("#")
            path = posixpath.normpath(posixpath.join(posixpath.dirname(source), path)) if path else source
            assert os.path.exists(os.path.join(program.SOURCE, path)), (source, link)
            assert not anchor or anchor in anchors(read(path)), (source, link)


def test_the_search_index_has_every_heading():
    """And text below it: search.json is [[page, title, [[anchor, heading, text] ...]] ...]."""
    with program.daemon() as daemon:
        index = daemon.get("/guide/search.json").json()
        assert [page for page, _, _ in index] == pages()
        for name, title, sections in index:
            served = Page(daemon.get(f"/guide/{name}.html").body.decode())
            assert sections[0][:2] == ["", title] and len(sections[0][2]) > 20, (name, sections[0])
            assert {anchor for anchor, _, _ in sections[1:]} <= set(served.ids), name


def test_generated_parts_have_all_that_the_program_has():
    """Every command, every path and schema of the API, every member of a scene's schema."""
    with program.daemon() as daemon:
        index = {page: {heading: text for _, heading, text in sections} for page, _, sections in daemon.get("/guide/search.json").json()}
    _, out, _ = program.run("--help")
    commands = {f"impactd {name}" for name in re.findall(r"^  (?:impactd )?([a-z][a-z-]*)\b", out, re.M)}
    assert len(commands) > 20, commands
    assert commands <= set(index["commands"]), commands - set(index["commands"])
    document = json.loads(read("schema", "openapi.json"))
    calls = {f"{method.upper()} {path}" for path, methods in document["paths"].items() for method in methods}
    calls |= {f"Schema {name}" for name in document["components"]["schemas"]}
    assert len(calls) > 150 and calls <= set(index["api"]), calls - set(index["api"])
    with open(os.path.join(program.build, "install", "scene.md"), encoding="utf-8") as file:
        members = set(re.findall(r"^\| `(\w+)` \|", file.read(), re.M))

    def named(schema):
        for name, one in schema.get("properties", {}).items():
            if "const" not in one:
                yield name
        for one in [*schema.get("properties", {}).values(), *schema.get("oneOf", []), *schema.get("anyOf", []), schema.get("items")]:
            if one:
                yield from named(one)

    wanted = set(named(json.loads(read("schema", "scene.schema.json"))))
    assert len(wanted) > 80 and wanted <= members, wanted - members


def render(change):
    """The messages of the build on a guide of two pages, changed by `change(folder)`; none if it is well."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("parts", "target"):
            os.mkdir(os.path.join(folder, name))
        files = {"pages.txt": "# Start\nindex\n\n# More\nother\n", "parts/table.md": "## Generated\n\nA part.\n",
                 "index.md": "# Start\n\nThis page is for tests.\n\n## One\n\n[Two](other.md#two--three)\n",
                 "other.md": "# Other\n\nThis page, too.\n\n## Two & *three*\n\n[Up](#other)\n\n![A picture](a.svg)\n\n<!-- generated: table -->\n",
                 "a.svg": "<svg/>", "guide.html": "<title>{{title}}</title>{{text}}{{pages}}{{contents}}{{previous}}{{next}}{{purpose}}"}
        for name, text in {**files, **change(files)}.items():
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(text)
        done = subprocess.run([os.path.join(program.build, "install", "print_guide"), folder, f"{folder}/parts", f"{folder}/target"],
                              capture_output=True, text=True, timeout=30, check=False)
        assert (done.returncode == 0) == (done.stderr == ""), done
        return done.stderr or sorted(os.listdir(os.path.join(folder, "target")))


def test_faults_of_pages_fail_the_build():
    """Each kind of fault is found where it is planted, and named."""
    def more(name, text):
        return lambda files: {name: files[name] + text}

    assert render(lambda files: {}) == ["index.html", "other.html", "search.json"]
    for change, wanted in (
            (more("index.md", "\n[x](none.md#y)\n"), "none"), (more("index.md", "\n[x](other.md#none)\n"), "#none"),
            (more("index.md", "\n[x](#none)\n"), "#none"), (more("index.md", "\n[x](../../none/none.md)\n"), "leads to no file"),
            (more("index.md", "\n[x](notes.txt)\n"), "leads to no page"), (more("index.md", "\n## One\n"), "two headings"),
            (more("index.md", "\n#### Deep\n"), "level 4"), (more("index.md", "\n# Again\n"), "level 1"),
            (more("index.md", "\n> ## Inner\n"), "within another"), (more("index.md", "\n<b>x</b>\n"), "HTML"),
            (more("index.md", "\n<!-- generated: none -->\n"), 'no generated part "none"'), (more("index.md", "\n![x](b.svg)\n"), "b.svg"),
            (more("index.md", "\n![](a.svg)\n"), "no description"), (more("pages.txt", "third\n"), "third"), (more("pages.txt", "other\n"), "twice"), (more("guide.html", "{{none}}"), "{{none}}"),
            (lambda files: {"third.md": files["index.md"]}, "third.md is not in pages.txt"),
            (lambda files: {"index.md": "Text.\n"}, "does not begin"), (lambda files: {"index.md": "# Title\n\n## Next\n"}, "does not begin")):
        messages = render(change)
        assert isinstance(messages, str) and wanted in messages, (wanted, messages)


if __name__ == "__main__":
    program.main(globals())
