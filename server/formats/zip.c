// local header, name, content; ...; directory entries, names; end.
#include "server/formats/zip.h"

#include <string.h>

enum {
    LOCAL = 0x04034b50,
    ENTRY = 0x02014b50,
    END = 0x06054b50,
    VERSION = 20,
    DATE = 0x0021, // 1980-01-01, the first that a ZIP knows
    MEMBERS_MAX = 0xfffe,
};

static const uint64_t bytes_max = 0xfffffffe;

// What local header and directory entry share.
static void put_facts(Segments *layout, uint32_t crc, uint64_t size, const char *name) {
    segments_number(layout, VERSION, 2);
    segments_number(layout, 0, 2); // flags
    segments_number(layout, 0, 2); // stored
    segments_number(layout, 0, 2); // midnight
    segments_number(layout, DATE, 2);
    segments_number(layout, crc, 4);
    segments_number(layout, size, 4);
    segments_number(layout, size, 4);
    segments_number(layout, strlen(name), 2);
    segments_number(layout, 0, 2); // nothing extra
}

static Status refuse(Problem *problem) {
    return problem_set(problem, STATUS_LIMIT,
                       "this would be larger than 4 GiB, which such an archive cannot be: ask for "
                       "fewer channels or a shorter time, or for .npy");
}

Status zip_put(Zip *zip, const char *name, const Segments *content, Problem *problem) {
    Segments *layout = zip->layout;
    const uint64_t start = layout->size;
    if (content->size > bytes_max || start + content->size + 1024 > bytes_max ||
        zip->count >= MEMBERS_MAX)
        return refuse(problem);
    const uint32_t crc = content->is_failed ? 0 : segments_crc32(content);
    segments_number(layout, LOCAL, 4);
    put_facts(layout, crc, content->size, name);
    segments_put(layout, name, strlen(name));
    segments_join(layout, content);

    segments_number(&zip->directory, ENTRY, 4);
    segments_number(&zip->directory, VERSION, 2);
    put_facts(&zip->directory, crc, content->size, name);
    segments_number(&zip->directory, 0, 2); // no comment
    segments_number(&zip->directory, 0, 2); // on the first disk
    segments_number(&zip->directory, 0, 2); // attributes
    segments_number(&zip->directory, 0, 4);
    segments_number(&zip->directory, start, 4);
    segments_put(&zip->directory, name, strlen(name));
    zip->count++;
    return STATUS_OK;
}

Status zip_end(Zip *zip, Problem *problem) {
    Segments *layout = zip->layout;
    const uint64_t start = layout->size, size = zip->directory.size;
    segments_join(layout, &zip->directory);
    segments_number(layout, END, 4);
    segments_number(layout, 0, 4); // on the first disk
    segments_number(layout, zip->count, 2);
    segments_number(layout, zip->count, 2);
    segments_number(layout, size, 4);
    segments_number(layout, start, 4);
    segments_number(layout, 0, 2); // no comment
    segments_clear(&zip->directory);
    zip->count = 0;
    return start + size > bytes_max ? refuse(problem) : STATUS_OK;
}
