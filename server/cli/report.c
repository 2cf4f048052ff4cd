// The text is written into memory first, so that one pass can make it ASCII where the locale says
// so. The page is one file: its charts are SVG inside it, and it loads nothing.
#include "server/cli/report.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "server/api/app.h"
#include "server/cli/files.h"
#include "server/http/reply.h"
#include "server/util/embedded.h"

enum { COLUMNS_MIN = 40, COLUMNS_MAX = 120, NOTES_SHOWN = 4 };

void report_clear(Report *report) {
    free(report->title);
    free(report->next);
    texts_clear(&report->sentences);
    warnings_clear(&report->notes);
    for (size_t i = 0; i < report->count; i++) {
        print_table_clear(&report->sections[i].table);
        if (report->sections[i].chart != NULL)
            chart_clear(report->sections[i].chart);
        free(report->sections[i].chart);
    }
    *report = (Report){.is_page = report->is_page};
}

void report_title(Report *report, const char *title) {
    report->is_failed = text_copy(title, &report->title) != STATUS_OK || report->is_failed;
    text_make_printable(report->title);
}

static const char *report_fit(char text[1000], const char *format, va_list arguments) {
    text_fit_format(text, 1000, format, arguments);
    text_make_printable(text);
    return text;
}

void report_sentence(Report *report, const char *format, ...) {
    char text[1000];
    va_list arguments;
    va_start(arguments, format);
    (void)report_fit(text, format, arguments);
    va_end(arguments);
    if (text[0] >= 'a' && text[0] <= 'z')
        text[0] = (char)(text[0] - 'a' + 'A');
    if (texts_append(&report->sentences, text) != STATUS_OK)
        report->is_failed = true;
}

void report_next(Report *report, const char *format, ...) {
    char text[1000], *last = report->next;
    va_list arguments;
    va_start(arguments, format);
    report->is_failed =
        text_copy(report_fit(text, format, arguments), &report->next) != STATUS_OK ||
        report->is_failed;
    va_end(arguments);
    free(last);
}

void report_notes(Report *report, const Warnings *warnings) {
    for (size_t i = 0; warnings != NULL && i < warnings->count; i++)
        if (warnings_add(&report->notes, warnings->at[i].pointer, "%s", warnings->at[i].detail) !=
            STATUS_OK)
            report->is_failed = true;
}

ReportSection *report_section(Report *report, const char *heading) {
    ReportSection *section =
        &report->sections[report->count < REPORT_SECTIONS ? report->count++ : 0];
    if (section->heading == NULL)
        section->heading = heading;
    return section;
}

PrintTable *report_table(Report *report, const char *heading, const char *heads) {
    PrintTable *table = &report_section(report, heading)->table;
    table->columns = heads != NULL ? 0 : 2;
    table->has_heads = heads != NULL;
    while (heads != NULL) {
        const size_t length = strcspn(heads, "|");
        print_table_add(table, "%.*s", (int)length, heads);
        table->columns++;
        heads = heads[length] != '\0' ? heads + length + 1 : NULL;
    }
    return table;
}

Chart *report_chart(Report *report, const char *heading, size_t panels, size_t height) {
    ReportSection *section = report_section(report, heading);
    section->chart = calloc(1, sizeof *section->chart);
    section->panels = panels;
    section->height = height;
    section->is_page_only = panels == 0;
    report->is_failed = report->is_failed || section->chart == NULL;
    return section->chart;
}

void report_real(PrintTable *table, double value) {
    if (isnan(value))
        print_table_add(table, "%s", "");
    else
        print_table_add(table, "%.6g", value);
}

void report_fact(PrintTable *table, const char *name, Bytes *text) {
    print_table_add(table, "%s", name);
    print_table_add(table, "%s", text->at != NULL ? text->at : "");
    bytes_clear(text);
}

const char *report_seconds(char target[32], double seconds) {
    snprintf(target, 32, seconds < 1 ? "%.3g ms" : "%.3g s", seconds < 1 ? 1e3 * seconds : seconds);
    return target;
}

void report_quantity(PrintTable *table, const char *name, const char *unit) {
    char words[80];
    text_fit(words, sizeof words, name);
    for (char *c = words; *c != '\0'; c++)
        *c = *c == '_' ? ' ' : *c;
    print_table_add(table, "%s%s%s%s", words, unit != NULL ? " [" : "", unit != NULL ? unit : "",
                    unit != NULL ? "]" : "");
}

// --- terminal ---

static bool terminal_has_utf8(void) {
    static const char *const names[] = {"LC_ALL", "LC_CTYPE", "LANG"};
    for (size_t i = 0; i < COUNT(names); i++) {
        const char *value = getenv(names[i]);
        if (value != NULL && *value != '\0')
            return strstr(value, "UTF-8") != NULL || strstr(value, "utf8") != NULL ||
                   strstr(value, "utf-8") != NULL || strstr(value, "UTF8") != NULL;
    }
    return false;
}

bool terminal_find(Terminal *terminal) {
    const char *columns = getenv("COLUMNS"), *type = getenv("TERM"), *plain = getenv("NO_COLOR");
    struct winsize size = {.ws_col = 0};
    if (!isatty(STDOUT_FILENO))
        return false;
    terminal->columns = columns != NULL ? strtoul(columns, NULL, 10) : 0;
    if (terminal->columns == 0 && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0)
        terminal->columns = size.ws_col;
    terminal->columns = terminal->columns == 0            ? 80
                        : terminal->columns < COLUMNS_MIN ? COLUMNS_MIN
                        : terminal->columns > COLUMNS_MAX ? COLUMNS_MAX
                                                          : terminal->columns;
    terminal->is_utf8 = terminal_has_utf8();
    terminal->has_colour = type != NULL && *type != '\0' && strcmp(type, "dumb") != 0 &&
                           (plain == NULL || *plain == '\0');
    return true;
}

PrintTableForm terminal_table_form(void) {
    Terminal terminal;
    const bool is_terminal = terminal_find(&terminal);
    return (PrintTableForm){.width = is_terminal ? terminal.columns : 0,
                            .has_colour = is_terminal && terminal.has_colour};
}

// --- text ---

typedef struct ReportText {
    const Terminal *terminal;
    FILE *file;
} ReportText;

static void report_style(const ReportText *text, const char *style) {
    if (text->terminal->has_colour)
        fprintf(text->file, "\033[%sm", style);
}

// Words with line feeds where the line ends, each behind `mark`; further lines begin with `indent`
// spaces.
static void report_wrap_marked(const ReportText *text, const char *words, size_t used, int indent,
                               const char *mark) {
    size_t at = used;
    for (bool is_first = true; *words != '\0'; is_first = false) {
        size_t length = strcspn(words, " "), width = 0;
        if (strncmp(words + length, " %", 2) == 0) // stays behind its number
            length += 1 + strcspn(words + length + 1, " ");
        for (size_t i = 0; i < length; i++)
            width += ((unsigned char)words[i] & 0xC0) != 0x80;
        if (!is_first && at + 1 + width + strlen(mark) > text->terminal->columns) {
            fprintf(text->file, "%s\n%*s", mark, indent, "");
            at = (size_t)indent;
        } else if (!is_first) {
            fputc(' ', text->file);
            at++;
        }
        fprintf(text->file, "%.*s", (int)length, words);
        at += width;
        words += length + strspn(words + length, " ");
    }
    fputc('\n', text->file);
}

static void report_wrap(const ReportText *text, const char *words, size_t used, int indent) {
    report_wrap_marked(text, words, used, indent, "");
}

static void report_put_section(const ReportText *text, ReportSection *section) {
    const Terminal *terminal = text->terminal;
    const bool is_list = !section->table.has_heads && section->table.count > 0;
    if (section->is_page_only || (section->table.count == 0 && section->chart == NULL))
        return;
    fputc('\n', text->file);
    if (section->heading != NULL && section->chart == NULL) {
        report_style(text, "1");
        fprintf(text->file, "%s\n", section->heading);
        report_style(text, "0");
    }
    // Names and values: long values continue below themselves.
    size_t name = 0;
    for (size_t i = 0; is_list && i < section->table.count; i += 2)
        name =
            text_width(section->table.cells[i]) > name ? text_width(section->table.cells[i]) : name;
    for (size_t i = 0; is_list && i + 1 < section->table.count; i += 2) {
        fprintf(text->file, "%-*s  ", (int)name, section->table.cells[i]);
        report_wrap(text, section->table.cells[i + 1], name + 2, (int)name + 2);
    }
    if (section->table.has_heads)
        print_table_print(&section->table,
                          &(PrintTableForm){terminal->columns, section->rows, terminal->has_colour},
                          text->file);
    Bytes chart = {.count = 0};
    for (size_t i = 0; section->chart != NULL && i < section->panels; i++)
        chart_write_text(section->chart, section->first + i,
                         &(ChartText){terminal->columns, section->height, terminal->is_utf8,
                                      terminal->has_colour},
                         &chart);
    if (chart.count > 0)
        fputs(chart.at, text->file);
    bytes_clear(&chart);
}

static void report_put_notes(const ReportText *text, const Warnings *notes) {
    if (notes->count > 0)
        fputc('\n', text->file);
    for (size_t i = 0; i < notes->count && i < NOTES_SHOWN; i++) {
        char line[1000];
        snprintf(line, sizeof line, "%s%s%s", notes->at[i].pointer,
                 notes->at[i].pointer[0] != '\0' ? ": " : "", notes->at[i].detail);
        text_make_printable(line);
        report_style(text, "33");
        fputs("Note  ", text->file);
        report_style(text, "0");
        report_wrap(text, line, 6, 6);
    }
    if (notes->count > NOTES_SHOWN)
        fprintf(text->file, "      and %zu more notes, which --json has\n",
                notes->count - NOTES_SHOWN);
}

static void report_put_file(const ReportText *text, const char *path) {
    char line[4100];
    text_fit(line, sizeof line, path);
    text_make_printable(line);
    fprintf(text->file, "Wrote %s\n", line);
}

static void report_put(const ReportText *text, Report *report, const Texts *files) {
    if (report->title != NULL) {
        report_style(text, "1");
        report_wrap(text, report->title, 0, 0);
        report_style(text, "0");
    }
    for (size_t i = 0; i < report->sentences.count; i++)
        report_wrap(text, report->sentences.at[i], 0, 0);
    for (size_t i = 0; i < report->count; i++)
        report_put_section(text, &report->sections[i]);
    report_put_notes(text, &report->notes);
    fputc('\n', text->file);
    for (size_t i = 0; i < files->count; i++)
        report_put_file(text, files->at[i]);
    if (report->next != NULL) {
        fputs("Next  ", text->file);
        report_style(text, "36");
        report_wrap_marked(text, report->next, 6, 6, " \\"); // one command when it is pasted
        report_style(text, "0");
    }
}

void report_print(Report *report, const Terminal *terminal, const Texts *files) {
    char *at = NULL;
    size_t size = 0;
    FILE *file = open_memstream(&at, &size);
    if (file == NULL)
        return;
    report_put(&(ReportText){terminal, file}, report, files);
    if (fclose(file) == 0)
        for (size_t i = 0; i < size; i++) {
            const bool is_ascii = (unsigned char)at[i] < 0x80;
            if (terminal->is_utf8 || is_ascii)
                putchar(at[i]);
            else if (((unsigned char)at[i] & 0xC0) != 0x80)
                putchar('?');
        }
    free(at);
}

// --- page ---

static void page_put(Bytes *bytes, const char *before, const char *text, const char *after) {
    bytes_text(bytes, before);
    chart_escape(bytes, text);
    bytes_text(bytes, after);
}

static void page_put_table(const PrintTable *table, Bytes *bytes) {
    const size_t columns = table->columns, heads = table->has_heads ? columns : 0;
    bytes_text(bytes, "<div class=\"scroll\"><table>\n");
    for (size_t i = 0; i < table->count; i++) {
        const bool is_head = i < heads, is_name = is_head || i % columns == 0;
        const bool is_numeric = print_table_is_numeric(table, i % columns);
        if (i % columns == 0)
            bytes_text(bytes, i == 0 && heads > 0 ? "<thead><tr>"
                              : i == heads        ? "<tbody><tr>"
                                                  : "<tr>");
        bytes_format(bytes, "<%s%s%s>", is_name ? "th" : "td",
                     !is_name  ? ""
                     : is_head ? " scope=\"col\""
                               : " scope=\"row\"",
                     is_numeric ? " class=\"n\"" : "");
        page_put(bytes, "", print_table_cell(table, i), is_name ? "</th>" : "</td>");
        if ((i + 1) % columns == 0)
            bytes_text(bytes, is_head ? "</tr></thead>\n" : "</tr>\n");
    }
    bytes_text(bytes, table->count > heads ? "</tbody></table></div>\n" : "</table></div>\n");
}

void report_write_page(Report *report, const ReportPage *page, Bytes *bytes) {
    const char *title = report->title != NULL ? report->title : page->source;
    bytes_text(bytes, "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    page_put(bytes, "<title>", title, "</title>\n<style>\n");
    bytes_text(bytes, embedded_find(embedded_web, "web/report.css")->bytes);
    page_put(bytes, "</style>\n</head>\n<body>\n<main>\n<h1>", title, "</h1>\n");
    for (size_t i = 0; i < report->sentences.count; i++)
        page_put(bytes, "<p>", report->sentences.at[i], "</p>\n");
    for (size_t i = 0; i < report->count; i++) {
        ReportSection *section = &report->sections[i];
        if (section->table.count == 0 && (section->chart == NULL || section->chart->count == 0))
            continue;
        if (section->heading != NULL)
            page_put(bytes, "<h2>", section->heading, "</h2>\n");
        if (section->table.count > 0)
            page_put_table(&section->table, bytes);
        if (section->chart == NULL || section->chart->count == 0)
            continue;
        bytes_text(bytes, "<figure>\n");
        chart_write(section->chart, bytes);
        bytes_text(bytes, "</figure>\n");
    }
    if (report->notes.count > 0)
        bytes_text(bytes, "<h2>Notes</h2>\n<ul class=\"notes\">\n");
    for (size_t i = 0; i < report->notes.count; i++) {
        page_put(bytes, "<li><code>", report->notes.at[i].pointer, "</code> ");
        page_put(bytes, "", report->notes.at[i].detail, "</li>\n");
    }
    bytes_text(bytes, report->notes.count > 0 ? "</ul>\n" : "");
    page_put(bytes, "<h2>Scene</h2>\n<p>The scene of <code>", page->source,
             "</code> with all defaults. <code>impactd run</code> or <code>impactd study</code> "
             "makes this result again from it.</p>\n");
    Bytes scene = {.count = 0};
    reply_indent_json(&scene, page->scene->at, page->scene->count);
    page_put(bytes, "<details><summary>Show the scene</summary>\n<pre>",
             scene.at != NULL ? scene.at : "", "</pre></details>\n");
    bytes->is_failed = bytes->is_failed || scene.is_failed || report->is_failed;
    bytes_clear(&scene);
    bytes_format(bytes, "<footer>\n<p>Made by impactd %s, engine %s. ", program_version,
                 engine_version);
    page_put(
        bytes, "Result <code>", page->result,
        "</code>: the SHA-256 of scene and engine, so that equal results have equal ids.</p>\n"
        "<p>To cite: the version of impactd and the id above, and K. Li and A. P. Darby, "
        "Modelling a buffered impact damper system using a spring-damper model of impact, "
        "Structural Control and Health Monitoring 16 (2009) 287-302, doi:10.1002/stc.238.</p>\n"
        "</footer>\n</main>\n</body>\n</html>\n");
}
