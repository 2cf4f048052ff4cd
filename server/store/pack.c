// Texts are their size with the NUL (0: NULL) and their bytes; everything else is its bytes in
// memory, for the same program reads it on the same machine.
#include "server/store/pack.h"

#include <stdlib.h>
#include <string.h>

#include "server/base/deflate.h"

static bool is_text(const RowColumn *column) {
    return column->kind == COLUMN_TEXT || column->kind == COLUMN_NAME;
}

size_t pack_row(const RowColumn *columns, const void *item, char *target, size_t room) {
    size_t used = 0;
    for (const RowColumn *column = columns; column->kind != COLUMN_END; column++) {
        const char *member = (const char *)item + column->offset;
        const void *data = member;
        size_t size = column->size;
        if (is_text(column)) {
            const char *text =
                column->kind == COLUMN_NAME ? member : *(char *const *)(const void *)member;
            size = text == NULL ? 0 : strlen(text) + 1;
            data = text;
            const uint32_t told = (uint32_t)size;
            if (size > UINT32_MAX || room - used < sizeof told)
                return 0;
            memcpy(target + used, &told, sizeof told);
            used += sizeof told;
        }
        if (room - used < size)
            return 0;
        if (size > 0)
            memcpy(target + used, data, size);
        used += size;
    }
    return used;
}

bool pack_read(const RowColumn *columns, const char *at, size_t size, void *item) {
    for (const RowColumn *column = columns; column->kind != COLUMN_END; column++) {
        char *member = (char *)item + column->offset;
        uint32_t count = (uint32_t)column->size;
        if (is_text(column)) {
            if (size < sizeof count)
                return false;
            memcpy(&count, at, sizeof count);
            at += sizeof count;
            size -= sizeof count;
        }
        if (size < count || (is_text(column) && count > 0 && at[count - 1] != '\0') ||
            (column->kind == COLUMN_NAME && (count == 0 || count > column->size)))
            return false;
        if (column->kind == COLUMN_TEXT)
            *(const char **)(void *)member = count > 0 ? at : NULL;
        else
            memcpy(member, at, count);
        at += count;
        size -= count;
    }
    return size == 0;
}

bool pack_own(const RowColumn *columns, void *item) {
    bool is_whole = true;
    for (const RowColumn *column = columns; column->kind != COLUMN_END; column++) {
        char **text = (char **)(void *)((char *)item + column->offset);
        if (column->kind == COLUMN_TEXT && *text != NULL) {
            *text = strdup(*text);
            is_whole = is_whole && *text != NULL;
        }
    }
    for (const RowColumn *column = columns; !is_whole && column->kind != COLUMN_END; column++) {
        char **text = (char **)(void *)((char *)item + column->offset);
        if (column->kind == COLUMN_TEXT) {
            free(*text);
            *text = NULL;
        }
    }
    return is_whole;
}

uint32_t pack_layout(const RowColumn *columns) {
    uint32_t sum = 0;
    for (const RowColumn *column = columns; column->kind != COLUMN_END; column++) {
        const uint64_t facts[] = {(uint64_t)column->kind, column->size};
        sum = deflate_crc32(sum, column->name, strlen(column->name) + 1);
        sum = deflate_crc32(sum, facts, sizeof facts);
    }
    return sum;
}
