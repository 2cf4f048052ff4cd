// print_pages FOLDER: writes what `cmake --install` installs beside the program.
#include <stdio.h>

#include "core/base/status.h"
#include "server/install/pages.h"

static const struct {
    const char *name;
    void (*print)(FILE *file);
} pages[] = {
    {"impactd.1", manual_program},
    {"impactd-scene.5", manual_scene},
    {"impactd.bash", completion_bash},
};

int main(int argc, char **argv) {
    char path[4096];
    for (size_t i = 0; argc == 2 && i < COUNT(pages); i++) {
        snprintf(path, sizeof path, "%s/%s", argv[1], pages[i].name);
        FILE *file = fopen(path, "w");
        if (file == NULL) {
            perror(path);
            return 1;
        }
        pages[i].print(file);
        if (fclose(file) != 0) {
            perror(path);
            return 1;
        }
    }
    return argc == 2 ? 0 : 2;
}
