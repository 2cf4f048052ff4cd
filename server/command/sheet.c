#include "server/command/sheet.h"

#include <stdio.h>
#include <string.h>

#include "server/client/told.h"

enum { WIDEST = 40 }; // of a column; what is longer pushes its own row alone

// Characters of UTF-8 as a terminal counts most of them.
static int width_of(const char *text) {
    int width = 0;
    for (; *text != '\0'; text++)
        width += ((unsigned char)*text & 0xC0) != 0x80;
    return width;
}

static void cell_print(const char *text, int width, bool is_last) {
    fputs(text, stdout);
    if (is_last)
        fputc('\n', stdout);
    else
        printf("%*s", 2 + (width > width_of(text) ? width - width_of(text) : 0), "");
}

static void block_print(const OutlineBlock *block) {
    int widths[OUTLINE_COLUMNS] = {0};
    for (size_t i = 0; i < block->rows * block->columns; i++) {
        const int width = width_of(block->cells[i]);
        int *widest = &widths[i % block->columns];
        if (width > *widest && width <= WIDEST)
            *widest = width;
    }
    for (size_t i = 0; i < block->rows * block->columns; i++) {
        const bool is_unknown = block->has_heads && block->cells[i][0] == '\0';
        const size_t column = i % block->columns;
        cell_print(is_unknown ? "-" : block->cells[i], widths[column],
                   column + 1 == block->columns);
    }
    if (block->more > 0)
        printf("... and %zu more; --json has all\n", block->more);
}

void sheet_print(Outline *outline) {
    for (size_t i = 0; i < outline->count; i++) {
        OutlineBlock *block = &outline->at[i];
        for (size_t k = 0; k < block->rows * block->columns; k++)
            told_tame(block->cells[k]);
        told_tame(block->heading);
        if (i > 0)
            putchar('\n');
        const bool is_same = i > 0 && strcmp(block->heading, outline->at[i - 1].heading) == 0;
        if (block->heading[0] != '\0' && outline->count > 1 && !is_same)
            puts(block->heading);
        block_print(block);
    }
    if (outline->is_cut)
        puts("\n... and more; --json has all");
}
