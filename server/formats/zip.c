// local header, name, content; ...; directory entries, names; end.
#include "server/formats/zip.h"

#include <string.h>

enum {
    LOCAL = 0x04034b50,
    ENTRY = 0x02014b50,
    END = 0x06054b50,
    VERSION = 20,
    DATE = 0x0021, // 1980-01-01, the first of a ZIP
    MEMBERS_MAX = 0xfffe,
};

static const uint64_t bytes_max = 0xfffffffe;

// What local header and directory entry share.
static void zip_put_facts(Segments *segments, uint32_t crc, uint64_t size, const char *name) {
    segments_number(segments, VERSION, 2);
    segments_number(segments, 0, 2); // flags
    segments_number(segments, 0, 2); // stored
    segments_number(segments, 0, 2); // midnight
    segments_number(segments, DATE, 2);
    segments_number(segments, crc, 4);
    segments_number(segments, size, 4);
    segments_number(segments, size, 4);
    segments_number(segments, strlen(name), 2);
    segments_number(segments, 0, 2); // nothing extra
}

static Status zip_refuse(Problem *problem) {
    return problem_set(problem, STATUS_LIMIT,
                       "this would be larger than 4 GiB, which such an archive cannot be: ask for "
                       "fewer channels or a shorter time, or for .npy");
}

Status zip_put(Zip *zip, const char *name, const Segments *content, Problem *problem) {
    Segments *segments = zip->segments;
    const uint64_t start = segments->size;
    if (content->size > bytes_max || start + content->size + 1024 > bytes_max ||
        zip->count >= MEMBERS_MAX)
        return zip_refuse(problem);
    const uint32_t crc = content->is_failed ? 0 : segments_crc32(content);
    segments_number(segments, LOCAL, 4);
    zip_put_facts(segments, crc, content->size, name);
    segments_put(segments, name, strlen(name));
    segments_join(segments, content);

    segments_number(&zip->directory, ENTRY, 4);
    segments_number(&zip->directory, VERSION, 2);
    zip_put_facts(&zip->directory, crc, content->size, name);
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
    Segments *segments = zip->segments;
    const uint64_t start = segments->size, size = zip->directory.size;
    segments_join(segments, &zip->directory);
    segments_number(segments, END, 4);
    segments_number(segments, 0, 4); // on the first disk
    segments_number(segments, zip->count, 2);
    segments_number(segments, zip->count, 2);
    segments_number(segments, size, 4);
    segments_number(segments, start, 4);
    segments_number(segments, 0, 2); // no comment
    segments_clear(&zip->directory);
    zip->count = 0;
    return start + size > bytes_max ? zip_refuse(problem) : STATUS_OK;
}
