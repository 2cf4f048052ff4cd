// print_guide GUIDE PARTS TARGET: the pages of the guide as HTML, and their search index. A tool of
// the build, not part of the program.
//
//   GUIDE/pages.txt   the order of the pages: "# Group", and the names of its pages below
//   GUIDE/NAME.md     a page: "# Title", a sentence on its purpose, the text (GitHub Markdown)
//   GUIDE/guide.html  what surrounds the text of every page, with {{placeholders}}
//   PARTS/NAME.md     replaces the line "<!-- generated: NAME -->" of a page
//   TARGET/NAME.html, TARGET/search.json
//
// Every fault of a page fails the build: a link or an anchor that leads nowhere, a picture that is
// missing or has no description, two headings with one anchor, HTML, a part without a file.
#include <cmark-gfm-core-extensions.h>
#include <cmark-gfm.h>
#include <dirent.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/base/field.h"
#include "server/cli/files.h"
#include "server/formats/chart.h"

enum { GUIDE_PAGES = 100, GUIDE_HEADINGS = 1000, GUIDE_PATH = 4096, GUIDE_NAME = 160 };

typedef struct GuideHeading {
    int level;
    Bytes text, slug;
    Bytes body; // all text below it up to the next heading, for the search
} GuideHeading;

typedef struct GuideLink {
    char page[GUIDE_NAME]; // that it leads to
    char anchor[GUIDE_NAME];
} GuideLink;

typedef struct GuidePage {
    char name[GUIDE_NAME], group[GUIDE_NAME];
    Bytes html, purpose;
    GuideHeading headings[GUIDE_HEADINGS];
    size_t heading_count;
    GuideLink links[GUIDE_HEADINGS];
    size_t link_count;
} GuidePage;

static struct {
    const char *folder, *parts, *target;
    GuidePage *pages[GUIDE_PAGES];
    size_t page_count;
    size_t faults;
} guide;

__attribute__((format(printf, 2, 3))) static void guide_fault(const GuidePage *page,
                                                              const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fprintf(stderr, "%s/%s: ", guide.folder, page != NULL ? page->name : "");
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    guide.faults++;
}

static bool guide_read(const char *folder, const char *name, const char *extension, Bytes *text) {
    static Problem problem;
    char path[GUIDE_PATH];
    snprintf(path, sizeof path, "%s/%s%s", folder, name, extension);
    problem_clear(&problem);
    return access(path, R_OK) == 0 && input_read(path, text, &problem) == STATUS_OK;
}

static void guide_write(const char *name, const char *extension, const Bytes *text) {
    static Problem problem;
    char path[GUIDE_PATH];
    snprintf(path, sizeof path, "%s/%s%s", guide.target, name, extension);
    problem_clear(&problem);
    if (text->is_failed || output_put(path, text, &problem) != STATUS_OK)
        guide_fault(NULL, "%s cannot be written: %s", path, problem.detail);
}

static const char *bytes_string(const Bytes *bytes) {
    return bytes->at != NULL ? bytes->at : "";
}

// As GitHub makes it: lower case, hyphens for spaces, and neither punctuation nor symbols: of UTF-8
// those are U+0080 to U+00BF, U+00D7 and U+2000 to U+2FFF.
static void slug_write(const char *text, Bytes *slug) {
    for (const unsigned char *c = (const unsigned char *)text; *c != '\0'; c++) {
        if (*c == 0xc2 || (*c == 0xc3 && c[1] == 0x97))
            c += 1;
        else if (*c == 0xe2)
            c += 2;
        else if (*c >= 0x80 || *c == '_' || *c == '-' || (*c >= '0' && *c <= '9') ||
                 (*c >= 'a' && *c <= 'z'))
            bytes_put(slug, c, 1);
        else if (*c >= 'A' && *c <= 'Z')
            bytes_put(slug, &(char){(char)(*c - 'A' + 'a')}, 1);
        else if (*c == ' ')
            bytes_text(slug, "-");
    }
}

static GuidePage *page_find(const char *name) {
    for (size_t i = 0; i < guide.page_count; i++)
        if (strcmp(guide.pages[i]->name, name) == 0)
            return guide.pages[i];
    return NULL;
}

static const GuideHeading *heading_find(const GuidePage *page, const char *slug) {
    for (size_t i = 0; i < page->heading_count; i++)
        if (strcmp(bytes_string(&page->headings[i].slug), slug) == 0)
            return &page->headings[i];
    return NULL;
}

// --- the order of the pages ---

static void pages_add(const char *name, const char *group) {
    GuidePage *page = page_find(name) == NULL ? calloc(1, sizeof *page) : NULL;
    if (page == NULL || guide.page_count == GUIDE_PAGES) {
        guide_fault(page, "%s: twice in pages.txt, or too many pages", name);
        free(page);
        return;
    }
    snprintf(page->name, sizeof page->name, "%s", name);
    snprintf(page->group, sizeof page->group, "%s", group);
    guide.pages[guide.page_count++] = page;
}

static void pages_read_order(void) {
    static Bytes text;
    char group[GUIDE_NAME] = "";
    if (!guide_read(guide.folder, "pages", ".txt", &text))
        guide_fault(NULL, "pages.txt cannot be read");
    for (const char *line = bytes_string(&text); *line != '\0';) {
        const size_t length = strcspn(line, "\n");
        char name[GUIDE_NAME];
        snprintf(name, sizeof name, "%.*s", (int)length, line);
        line += length + (line[length] == '\n');
        if (name[0] == '#')
            snprintf(group, sizeof group, "%s", name + 1 + strspn(name + 1, " "));
        else if (name[0] != '\0')
            pages_add(name, group);
    }
}

static void pages_check_order(void) {
    DIR *folder = opendir(guide.folder);
    for (struct dirent *file; folder != NULL && (file = readdir(folder)) != NULL;) {
        char name[GUIDE_NAME];
        const char *extension = strrchr(file->d_name, '.');
        if (extension == NULL || strcmp(extension, ".md") != 0)
            continue;
        snprintf(name, sizeof name, "%.*s", (int)(extension - file->d_name), file->d_name);
        if (page_find(name) == NULL)
            guide_fault(NULL, "%s is not in pages.txt", file->d_name);
    }
    if (folder != NULL)
        closedir(folder);
}

// --- the text of a page ---

// The page with the parts in place of the lines that name them.
static void page_read(GuidePage *page, Bytes *source) {
    static const char mark[] = "<!-- generated: ";
    Bytes text = {.most = 0};
    if (!guide_read(guide.folder, page->name, ".md", &text))
        guide_fault(page, "cannot be read");
    for (const char *line = bytes_string(&text); *line != '\0';) {
        const size_t length = strcspn(line, "\n"), whole = length + (line[length] == '\n');
        char name[GUIDE_NAME] = "";
        if (strncmp(line, mark, sizeof mark - 1) == 0) {
            const char *from = line + sizeof mark - 1;
            snprintf(name, sizeof name, "%.*s", (int)strcspn(from, " \n"), from);
            Bytes part = {.most = 0};
            if (!guide_read(guide.parts, name, ".md", &part))
                guide_fault(page, "there is no generated part \"%s\"", name);
            bytes_text(source, bytes_string(&part));
            bytes_clear(&part);
        } else {
            bytes_put(source, line, whole);
        }
        line += whole;
    }
    bytes_clear(&text);
}

// All text within a node, one space between its pieces.
static void node_text(cmark_node *node, Bytes *text) {
    cmark_iter *iterator = cmark_iter_new(node);
    for (cmark_event_type event; (event = cmark_iter_next(iterator)) != CMARK_EVENT_DONE;) {
        cmark_node *at = cmark_iter_get_node(iterator);
        const cmark_node_type type = cmark_node_get_type(at);
        if (event == CMARK_EVENT_ENTER &&
            (type == CMARK_NODE_TEXT || type == CMARK_NODE_CODE || type == CMARK_NODE_CODE_BLOCK))
            bytes_text(text, cmark_node_get_literal(at));
        else if (type == CMARK_NODE_SOFTBREAK || type == CMARK_NODE_LINEBREAK ||
                 (event == CMARK_EVENT_EXIT && at != node &&
                  (type & CMARK_NODE_TYPE_MASK) == CMARK_NODE_TYPE_BLOCK))
            bytes_text(text, " ");
    }
    cmark_iter_free(iterator);
}

static void page_add_heading(GuidePage *page, cmark_node *node) {
    if (page->heading_count == GUIDE_HEADINGS) {
        guide_fault(page, "more than %d headings", GUIDE_HEADINGS);
        return;
    }
    GuideHeading heading = {.level = cmark_node_get_heading_level(node)};
    node_text(node, &heading.text);
    slug_write(bytes_string(&heading.text), &heading.slug);
    const char *text = bytes_string(&heading.text);
    const int last = page->heading_count > 0 ? page->headings[page->heading_count - 1].level : 0;
    if (heading_find(page, bytes_string(&heading.slug)) != NULL)
        guide_fault(page, "two headings have the anchor #%s", bytes_string(&heading.slug));
    if (heading.level > last + 1 || (heading.level == 1) != (last == 0))
        guide_fault(page, "the heading \"%s\" has level %d below one of level %d", text,
                    heading.level, last);
    page->headings[page->heading_count++] = heading;
}

// A link to a file of the sources is followed in the repository; on the server it is plain text.
static bool link_is_source(cmark_node *node) {
    return strncmp(cmark_node_get_url(node), "../../", 6) == 0;
}

static void page_unwrap_link(const GuidePage *page, cmark_node *node) {
    char path[GUIDE_PATH];
    const char *url = cmark_node_get_url(node);
    snprintf(path, sizeof path, "%s/%.*s", guide.folder, (int)strcspn(url, "#"), url);
    if (access(path, R_OK) != 0)
        guide_fault(page, "the link %s leads to no file", url);
    for (cmark_node *child; (child = cmark_node_first_child(node)) != NULL;)
        cmark_node_insert_before(node, child);
    cmark_node_free(node);
}

// A link to a page of the guide gets its address on the server.
static void page_add_link(GuidePage *page, cmark_node *node) {
    const char *url = cmark_node_get_url(node);
    const char *anchor = strchr(url, '#'), *colon = strchr(url, ':');
    const size_t length = strcspn(url, "#");
    const bool is_page = length > 3 && strncmp(url + length - 3, ".md", 3) == 0;
    // "../openapi.json" is of the server; tests ask it for every such link.
    if ((colon != NULL && colon < url + length) || (strncmp(url, "../", 3) == 0 && !is_page))
        return;
    if (!(is_page || length == 0) || memchr(url, '/', length) != NULL ||
        page->link_count == GUIDE_HEADINGS) {
        guide_fault(page, "the link %s leads to no page of the guide", url);
        return;
    }
    GuideLink *link = &page->links[page->link_count++];
    if (is_page)
        snprintf(link->page, sizeof link->page, "%.*s", (int)length - 3, url);
    else
        text_fit(link->page, sizeof link->page, page->name);
    snprintf(link->anchor, sizeof link->anchor, "%s", anchor != NULL ? anchor + 1 : "");
    Bytes target = {.most = 0};
    if (is_page && strcmp(link->page, "index") == 0)
        bytes_text(&target, "./");
    else if (is_page)
        bytes_format(&target, "%s.html", link->page);
    bytes_text(&target, anchor != NULL ? anchor : "");
    cmark_node_set_url(node, bytes_string(&target));
    bytes_clear(&target);
}

static void page_check_picture(const GuidePage *page, cmark_node *node) {
    char path[GUIDE_PATH];
    Bytes description = {.most = 0};
    node_text(node, &description);
    const char *url = cmark_node_get_url(node);
    snprintf(path, sizeof path, "%s/%s", guide.folder, url);
    if (strchr(url, '/') != NULL || access(path, R_OK) != 0)
        guide_fault(page, "the picture %s is not in this folder", url);
    if (description.count == 0)
        guide_fault(page, "the picture %s has no description", url);
    bytes_clear(&description);
}

static void page_walk(GuidePage *page, cmark_node *document) {
    cmark_iter *iterator = cmark_iter_new(document);
    for (cmark_event_type event; (event = cmark_iter_next(iterator)) != CMARK_EVENT_DONE;) {
        cmark_node *node = cmark_iter_get_node(iterator);
        const cmark_node_type type = cmark_node_get_type(node);
        const bool is_source = type == CMARK_NODE_LINK && link_is_source(node);
        if (event == CMARK_EVENT_EXIT && is_source)
            page_unwrap_link(page, node);
        if (event == CMARK_EVENT_EXIT || is_source)
            continue;
        if (type == CMARK_NODE_HEADING && cmark_node_parent(node) != document)
            guide_fault(page, "a heading within another block");
        else if (type == CMARK_NODE_HEADING)
            page_add_heading(page, node);
        else if (type == CMARK_NODE_LINK)
            page_add_link(page, node);
        else if (type == CMARK_NODE_IMAGE)
            page_check_picture(page, node);
        else if (type == CMARK_NODE_HTML_BLOCK || type == CMARK_NODE_HTML_INLINE)
            guide_fault(page, "HTML: %.60s", cmark_node_get_literal(node));
    }
    cmark_iter_free(iterator);
    // The text of each section is that of the blocks between two headings.
    GuideHeading *heading = page->headings;
    for (cmark_node *block = cmark_node_first_child(document); block != NULL;
         block = cmark_node_next(block))
        if (cmark_node_get_type(block) == CMARK_NODE_HEADING) {
            heading += block != cmark_node_first_child(document);
        } else {
            node_text(block, &heading->body);
            bytes_text(&heading->body, " ");
        }
    cmark_node *first = cmark_node_first_child(document);
    cmark_node *second = first != NULL ? cmark_node_next(first) : NULL;
    if (first == NULL || cmark_node_get_type(first) != CMARK_NODE_HEADING || second == NULL ||
        cmark_node_get_type(second) != CMARK_NODE_PARAGRAPH)
        guide_fault(page, "does not begin with \"# Title\" and a paragraph");
    else
        node_text(second, &page->purpose);
}

static void page_put_anchor(const GuideHeading *heading, Bytes *html) {
    bytes_format(html, " <a class=\"anchor\" href=\"#%s\" aria-label=\"Link to ",
                 bytes_string(&heading->slug));
    chart_escape(html, bytes_string(&heading->text));
    bytes_text(html, "\">#</a>");
}

// What cmark-gfm wrote, with anchors at headings, and tables in boxes that scroll: since pages have
// no HTML and text is escaped, these tags are of those elements.
static void page_finish_html(GuidePage *page, const char *html) {
    static const char *const tags[][2] = {
        {"<table>", "<div class=\"scroll\" tabindex=\"0\"><table>"},
        {"</table>", "</table></div>"},
        {"<pre>", "<pre tabindex=\"0\">"},
        {"<", "<"},
    };
    const GuideHeading *heading = page->headings;
    for (const char *rest = html; *rest != '\0';) {
        const size_t text = strcspn(rest, "<");
        bytes_put(&page->html, rest, text);
        rest += text;
        const bool is_end = strncmp(rest, "</h", 3) == 0;
        const char level = *rest == '\0'    ? '\0'
                           : is_end         ? rest[3]
                           : rest[1] == 'h' ? rest[2]
                                            : '\0';
        if (level >= '1' && level <= '6' && !is_end) {
            bytes_format(&page->html, "<h%c id=\"%s\">", level, bytes_string(&heading->slug));
            rest += strlen("<h1>");
        } else if (level >= '1' && level <= '6') {
            if (level > '1')
                page_put_anchor(heading, &page->html);
            bytes_format(&page->html, "</h%c>", level);
            rest += strlen("</h1>");
            heading += heading + 1 < page->headings + GUIDE_HEADINGS;
        } else if (*rest != '\0') {
            size_t i = 0;
            while (strncmp(rest, tags[i][0], strlen(tags[i][0])) != 0)
                i++;
            bytes_text(&page->html, tags[i][1]);
            rest += strlen(tags[i][0]);
        }
    }
}

static void page_parse(GuidePage *page) {
    static const char *const extensions[] = {"table", "strikethrough"};
    const int options = CMARK_OPT_FOOTNOTES | CMARK_OPT_VALIDATE_UTF8;
    Bytes source = {.most = 0};
    page_read(page, &source);
    cmark_parser *parser = cmark_parser_new(options);
    for (size_t i = 0; i < COUNT(extensions); i++)
        cmark_parser_attach_syntax_extension(parser, cmark_find_syntax_extension(extensions[i]));
    cmark_parser_feed(parser, bytes_string(&source), source.count);
    cmark_node *document = cmark_parser_finish(parser);
    page_walk(page, document);
    char *html = cmark_render_html(document, options, cmark_parser_get_syntax_extensions(parser));
    page_finish_html(page, html);
    free(html);
    cmark_node_free(document);
    cmark_parser_free(parser);
    bytes_clear(&source);
}

static void page_check_links(const GuidePage *page) {
    for (size_t i = 0; i < page->link_count; i++) {
        const GuideLink *link = &page->links[i];
        const GuidePage *target = page_find(link->page);
        if (target == NULL)
            guide_fault(page, "links to %s.md, which is not in pages.txt", link->page);
        else if (link->anchor[0] != '\0' && heading_find(target, link->anchor) == NULL)
            guide_fault(page, "%s.md has no heading with the anchor #%s", link->page, link->anchor);
    }
}

// --- what surrounds the text ---

static const char *page_title(const GuidePage *page) {
    return bytes_string(&page->headings[0].text);
}

static void page_put_link(const GuidePage *page, const char *attributes, Bytes *bytes) {
    const bool is_index = strcmp(page->name, "index") == 0;
    bytes_format(bytes, "<a href=\"%s%s\"%s>", is_index ? "./" : page->name,
                 is_index ? "" : ".html", attributes);
    chart_escape(bytes, page_title(page));
    bytes_text(bytes, "</a>");
}

static void page_put_pages(const GuidePage *page, Bytes *bytes) {
    const char *group = "";
    for (size_t i = 0; i < guide.page_count; i++) {
        const GuidePage *other = guide.pages[i];
        if (strcmp(other->group, group) != 0) {
            bytes_text(bytes, i > 0 ? "</ul>\n<h2>" : "<h2>");
            chart_escape(bytes, other->group);
            bytes_text(bytes, "</h2>\n<ul>\n");
            group = other->group;
        }
        bytes_text(bytes, "<li>");
        page_put_link(other, other == page ? " aria-current=\"page\"" : "", bytes);
        bytes_text(bytes, "</li>\n");
    }
    bytes_text(bytes, "</ul>");
}

// The headings of levels 2 and 3, or of level 2 alone where there are many.
static void page_put_contents(const GuidePage *page, Bytes *bytes) {
    size_t count = 0;
    for (size_t i = 0; i < page->heading_count; i++)
        count += page->headings[i].level <= 3;
    const int deepest = count <= 60 ? 3 : 2;
    bytes_text(bytes, "<ul>\n");
    for (size_t i = 1; i < page->heading_count; i++) {
        const GuideHeading *heading = &page->headings[i];
        if (heading->level > deepest)
            continue;
        bytes_format(bytes, "<li class=\"level%d\"><a href=\"#%s\">", heading->level,
                     bytes_string(&heading->slug));
        chart_escape(bytes, bytes_string(&heading->text));
        bytes_text(bytes, "</a></li>\n");
    }
    bytes_text(bytes, "</ul>");
}

static void page_put(const GuidePage *page, const char *name, Bytes *bytes) {
    size_t at = 0;
    while (guide.pages[at] != page)
        at++;
    if (strcmp(name, "title") == 0)
        chart_escape(bytes, page_title(page));
    else if (strcmp(name, "purpose") == 0)
        chart_escape(bytes, bytes_string(&page->purpose));
    else if (strcmp(name, "text") == 0)
        bytes_text(bytes, bytes_string(&page->html));
    else if (strcmp(name, "pages") == 0)
        page_put_pages(page, bytes);
    else if (strcmp(name, "contents") == 0)
        page_put_contents(page, bytes);
    else if (strcmp(name, "previous") == 0 && at > 0)
        page_put_link(guide.pages[at - 1], " rel=\"prev\"", bytes);
    else if (strcmp(name, "next") == 0 && at + 1 < guide.page_count)
        page_put_link(guide.pages[at + 1], " rel=\"next\"", bytes);
    else if (strcmp(name, "previous") != 0 && strcmp(name, "next") != 0)
        guide_fault(page, "guide.html has the unknown placeholder {{%s}}", name);
}

static void page_write(const GuidePage *page, const char *frame) {
    Bytes bytes = {.most = 0};
    for (const char *open; (open = strstr(frame, "{{")) != NULL;) {
        char name[GUIDE_NAME];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(open + 2, "}"), open + 2);
        bytes_put(&bytes, frame, (size_t)(open - frame));
        page_put(page, name, &bytes);
        frame = open + 2 + strcspn(open + 2, "}") + 2;
    }
    bytes_text(&bytes, frame);
    guide_write(page->name, ".html", &bytes);
    bytes_clear(&bytes);
}

// [[page, title, [[anchor, heading, text] ...]] ...], the first section of a page without anchor.
static void search_write(void) {
    Bytes bytes = {.most = 0};
    for (size_t i = 0; i < guide.page_count; i++) {
        const GuidePage *page = guide.pages[i];
        bytes_json(&bytes, i == 0 ? "[[%s,%s,[" : ",\n[%s,%s,[", page->name, page_title(page));
        for (size_t k = 0; k < page->heading_count; k++)
            bytes_json(&bytes, k == 0 ? "[%s,%s,%s]" : ",\n[%s,%s,%s]",
                       k == 0 ? "" : bytes_string(&page->headings[k].slug),
                       bytes_string(&page->headings[k].text),
                       bytes_string(&page->headings[k].body));
        bytes_text(&bytes, "]]");
    }
    bytes_text(&bytes, "]\n");
    guide_write("search", ".json", &bytes);
    bytes_clear(&bytes);
}

int main(int argc, char **argv) {
    static Bytes frame;
    if (argc != 4)
        return 2;
    guide.folder = argv[1];
    guide.parts = argv[2];
    guide.target = argv[3];
    cmark_gfm_core_extensions_ensure_registered();
    pages_read_order();
    pages_check_order();
    if (!guide_read(guide.folder, "guide", ".html", &frame))
        guide_fault(NULL, "guide.html cannot be read");
    for (size_t i = 0; i < guide.page_count; i++)
        page_parse(guide.pages[i]);
    for (size_t i = 0; i < guide.page_count; i++)
        page_check_links(guide.pages[i]);
    for (size_t i = 0; i < guide.page_count && guide.faults == 0; i++)
        page_write(guide.pages[i], bytes_string(&frame));
    if (guide.faults == 0)
        search_write();
    return guide.faults > 0 ? 1 : 0;
}
