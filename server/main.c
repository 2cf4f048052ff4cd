// impactd: the server and the command line in one program.
#include <fcntl.h>
#include <unistd.h>

#include "core/math/fft.h"
#include "server/api/app.h"
#include "server/cli/command.h"

// The first file opened takes the number of a closed standard stream, and would be given what is
// printed there. What holds its place refuses that.
static void keep_standard_streams(void) {
    for (int number = 0; number <= STDERR_FILENO; number++)
        if (fcntl(number, F_GETFD) < 0)
            (void)open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

int main(int argc, char **argv) {
    keep_standard_streams();
    fft_start();
    guide_files = embedded_guide;
    return command_main(argc, argv);
}
