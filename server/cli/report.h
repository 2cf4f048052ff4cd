// What a run or a study found, for people: sections of numbers, tables and charts, printed on a
// terminal or written as one HTML page.
#ifndef SERVER_CLI_REPORT_H
#define SERVER_CLI_REPORT_H

#include "core/study/study.h"
#include "server/formats/chart.h"
#include "server/json/table.h"

enum { REPORT_SECTIONS = 24 };

// All parts are optional.
typedef struct ReportSection {
    const char *heading;
    PrintTable table;
    size_t rows; // of the table on a terminal; 0: all
    Chart *chart;
    size_t first, panels, height; // on a terminal: panels and rows of each; 0: none
    bool is_page_only;            // not for a terminal
} ReportSection;

typedef struct Report {
    bool is_page; // sections that need further work are wanted
    char *title;
    Texts sentences;
    ReportSection sections[REPORT_SECTIONS];
    size_t count;
    Warnings notes;
    char *next; // options of `impactd run SCENE` that continue from here
    bool is_failed;
} Report;

// All zero but is_page is empty. Every text is copied, with '?' for control characters.
void report_clear(Report *report);
void report_title(Report *report, const char *title);
void report_sentence(Report *report, const char *format, ...) __attribute__((format(printf, 2, 3)));
// The options of the run that continues from here.
void report_next(Report *report, const char *format, ...) __attribute__((format(printf, 2, 3)));
void report_notes(Report *report, const Warnings *warnings);
// A section, which the report owns; never NULL.
ReportSection *report_section(Report *report, const char *heading);
// A table with heads, separated by '|'; NULL: names and values.
PrintTable *report_table(Report *report, const char *heading, const char *heads);
// An empty chart; NULL without memory.
Chart *report_chart(Report *report, const char *heading, size_t panels, size_t height);

// Cells: six digits; an unknown number is empty. The name of a quantity has spaces for its
// underscores, and its unit.
void report_real(PrintTable *table, double value);
void report_quantity(PrintTable *table, const char *name, const char *unit);
// A row of a table without heads; the text is cleared.
void report_fact(PrintTable *table, const char *name, Bytes *text);
const char *report_seconds(char target[32], double seconds); // "8.1 ms"

// The terminal of the standard output. False: it is a file or a pipe.
typedef struct Terminal {
    size_t columns;
    bool is_utf8, has_colour;
} Terminal;
bool terminal_find(Terminal *terminal);
// Of tables on standard output: on a terminal its width, and colour.
PrintTableForm terminal_table_form(void);

void report_print(Report *report, const Terminal *terminal, const Texts *files);

// What a page has beside its summary.
typedef struct ReportPage {
    const char *source; // the name of the scene's file
    const char *result; // its id
    const Bytes *scene; // JSON
} ReportPage;
void report_write_page(Report *report, const ReportPage *page, Bytes *bytes);

// --- what they contain ---

void report_of_run(Report *report, const Simulation *simulation, const Outcome *outcome,
                   double seconds);
// Of a scene without faults that has not been run.
void report_of_check(Report *report, const StudyRequest *request, const PlanReport *plan,
                     const Cost *cost);
void report_of_study(Report *report, const Variant *answer, double seconds);

#endif
